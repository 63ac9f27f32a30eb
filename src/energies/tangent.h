#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "base/handle.h"
#include "energies/potential.h"
#include "geometry/projectors.h"
#include "options/choice.h"

namespace pellicle::energies {

enum class TangentMatrix { baij, aij, sbaij, shell };
inline std::vector<std::string> names_of(TangentMatrix) { return {"baij", "aij", "sbaij", "shell"}; }

/// The matrix of Newton's method for a sum of potentials with the Hessian H: P H P + s (1 - P), with projectors P on
/// the directions in which the vertices may move; s is the mean of the diagonal, so that constrained directions do not
/// spoil the spectrum. Assembled (baij, aij, sbaij; block size 3) or matrix-free (shell); a shell still stores the
/// blocks of potentials that do not multiply themselves.
class Tangent {
 public:
  /// Makes pattern and matrix. Collective. @param vertices and potentials must outlive the tangent
  /// @param projectors of the local vertices @param prefix of the options of the matrix, such as "prism_"
  Tangent(const Layout& vertices, std::vector<Potential*> potentials, Projectors projectors,
          const Choice<TangentMatrix>& type, const std::string& prefix);
  Tangent(const Tangent&) = delete;  // PETSc's matrix points to this object.
  Tangent& operator=(const Tangent&) = delete;

  /// Makes the rows anew if the sum of the potentials' pattern versions has changed: `matrix` stays the same object,
  /// without values, but preconditioners and copies made from it become useless (LowRankSystem::forget_pattern).
  /// Collective.
  /// @returns whether the pattern has changed
  bool renew_pattern();
  /// Calls Potential::update_pattern of the potentials at Newton's iterate x, and renews the pattern. Collective.
  bool update_pattern(const Field& x);

  /// Renews the pattern and sets the values. With Curvature::psd the matrix is positive definite, as a millionth of the
  /// diagonal's mean is added to the diagonal. Collective. @param psd_blend as of Potential::update_hessian
  void update(const Field& x, double psd_blend);

  Mat matrix() const { return matrix_; }

  const Layout& vertices() const { return vertices_; }
  TangentMatrix type() const { return type_; }
  /// The vertices, with further ghosts for all that owned vertices are coupled with in the present pattern.
  const Layout& reach() const { return reach_; }
  /// Projectors of the vertices of `reach()`.
  const Projectors& projectors() const { return projectors_; }
  /// The owned vertices that may not move in all directions, ascending.
  const std::vector<PetscInt>& bound() const { return bound_; }
  /// Passes on the owned vertices' rows, as last updated, with vertices of `reach()`. Blocks that come several times
  /// are to be summed. For sbaij half of the blocks come. Terms in constrained directions may come or not. Not
  /// collective.
  void visit(HessianTerms& terms) const;

 private:
  /// The owned vertices' rows: blocks (3 x 3, by columns) in the order of their global columns.
  struct Rows {
    std::vector<PetscInt> offsets{0};     ///< first block of each row, (owned + 1)
    std::vector<PetscInt> columns;        ///< global vertex of each block
    std::vector<PetscInt> local_columns;  ///< vertex of each block in `reach_`
    std::vector<PetscInt> diagonal;       ///< block of each owned vertex with itself; shell: -1 if none is stored
    std::vector<Eigen::Matrix3d> blocks;  ///< [N/m]
  };
  struct Part {
    Potential* potential;
    bool multiplies = false;       ///< of a shell
    std::vector<PetscInt> places;  ///< block in `rows_` of each pair of the pattern, or -1; empty if it multiplies
    /// For a potential that multiplies without terms, both vertices in `reach_` of each pair of its pattern; row -1: of
    /// another rank.
    std::vector<std::array<PetscInt, 2>> pairs;
  };

  void make_rows();
  void extend_reach(const std::vector<std::vector<VertexPair>>& patterns);
  void make_assembled();
  void assemble(bool is_positive);
  void visit_part(const Part& part, HessianTerms& terms) const;
  void make_diagonal();
  void copy_diagonal(Vec out);
  void give_inverse_blocks(const PetscScalar** values);
  void multiply(Vec in, Vec out);
  /// Mean of the diagonal over all ranks; 1 if it is 0. Collective. @param own_sum of the owned vertices' diagonal
  double mean_of_diagonal(double own_sum) const;
  void hold(bool is_positive);
  bool is_shell() const { return type_ == TangentMatrix::shell; }
  PetscInt owned() const { return vertices_.owned; }

  const Layout& vertices_;
  std::vector<Part> parts_;
  Choice<TangentMatrix> type_;
  std::string prefix_;
  PetscInt version_ = -1;  ///< sum of the potentials' pattern versions; -1: there is no pattern yet

  Layout reach_;                  ///< see reach()
  LocalNumbers numbers_;          ///< in `reach_`
  Projectors projectors_;         ///< see projectors()
  std::vector<PetscInt> bound_;   ///< see bound()
  bool any_constrained_ = false;  ///< on any rank

  Rows rows_;
  double constrained_ = 0;                 ///< s of a shell [N/m]
  double definite_ = 0;                    ///< added to the diagonal of a positive shell [N/m]
  Field argument_;                         ///< of a product of the shell, for TermProduct (4 x reach)
  Eigen::Matrix4Xd product_;               ///< of the shell, for TermProduct (4 x local)
  Eigen::Matrix3Xd dense_argument_;        ///< (3 x reach), for potentials that multiply without terms
  Eigen::Matrix3Xd dense_product_;         ///< their products (3 x local)
  std::vector<Eigen::Matrix3d> diagonal_;  ///< of the shell's owned vertices, when last computed
  bool has_diagonal_ = false;              ///< whether `diagonal_` is that of the last update
  std::vector<Eigen::Matrix3d> inverse_;   ///< inverses of these blocks, when last computed
  MatHandle matrix_;
};

/// Multiplies the terms of a Hessian with a vector.
///
/// Vectors have four numbers for each local vertex, one vector register: x, y, z, and one for products along normals.
class TermProduct : public HessianTerms {
 public:
  /// @param owned, local numbers of vertices @param factor (4 x local); its last row is overwritten
  /// @param product (4 x local), to which products are added; for ghosts these are only parts of the sum
  TermProduct(PetscInt owned, PetscInt local, double* factor, double* product)
      : HessianTerms(owned), local_(local), factor_(factor), product_(product) {}

  void add_block(PetscInt row, PetscInt column, const Eigen::Matrix3d& block) override;
  void add_differences(const std::vector<DifferenceTerm>& terms) override;
  void add_numbers(const NumberRows& rows) override;

 private:
  PetscInt local_;
  double* factor_;
  double* product_;
};

/// Gives a BAIJ matrix with blocks of 3 a product of its own where the processor has AVX2 and FMA; elsewhere PETSc's
/// stays in use. While the matrix fits in the caches it takes two thirds of the time. To be called after preallocation.
void use_fast_product(Mat matrix);

}  // namespace pellicle::energies
