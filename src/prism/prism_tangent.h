#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <vector>

#include "base/handle.h"
#include "prism/metric_stiffness.h"
#include "prism/prism_elements.h"
#include "prism/prism_options.h"

namespace pellicle {

/// What a tangent is made of besides the elements' stiffness.
struct TangentInput {
  const Field& positions;                      ///< [m], ghosts up to date
  const std::vector<double>& thickness_ratio;  ///< of the local elements
  const std::vector<double>& load_pressure;    ///< of the local elements: whose load stiffness enters [Pa], or empty
  Eigen::Vector3d load_origin;                 ///< about which it is taken [m]
  const std::vector<Eigen::Matrix3d>& vertex_blocks;  ///< added to the diagonal block of each owned vertex [N/m]
  double lagged_factor = 0;                           ///< times the stiffness that `lag` kept: stiffness damping
  /// Positive definite whatever the state: of the elements' stiffness that part only which gives none of them a
  /// negative eigenvalue, no load stiffness, and a millionth of the diagonal's mean on the diagonal.
  bool positive = false;
};

/// The system matrix of a Newton iteration without the gas's low-rank part: P (K + loads + vertex blocks) P + s (1 - P)
/// with projectors P on the directions in which the vertices may move (and s the mean of the diagonal, so that held
/// directions do not spoil the spectrum). Assembled (baij, aij, sbaij; block size 3) or matrix-free (shell).
class PrismTangent {
 public:
  /// Makes pattern and matrix. Collective. Elements must outlive it. @param projectors of the local vertices
  PrismTangent(const PrismElements& elements, const PrismOptions& options,
               const std::vector<Eigen::Matrix3d>& projectors);
  PrismTangent(const PrismTangent&) = delete;
  PrismTangent& operator=(const PrismTangent&) = delete;

  /// Keeps the stiffness at these positions, without what would give an element negative eigenvalues, for
  /// `lagged_factor`. Not collective.
  void lag(const Field& positions, const std::vector<double>& thickness_ratio);

  /// Adds `factor` times the kept stiffness times `displacement` (local, ghosts up to date) to (3 x owned) `result`.
  void add_lagged_product(double factor, const Field& displacement, Eigen::Matrix3Xd& result) const;

  /// Sets the values. Collective.
  void update(const TangentInput& input);

  Mat matrix() const { return matrix_; }

 private:
  /// The owned vertices' rows of an assembled matrix: blocks (3 x 3, by columns) in the order of their global columns.
  struct Rows {
    std::vector<PetscInt> offsets{0};                 ///< first block of each row, (owned + 1)
    std::vector<PetscInt> columns;                    ///< global vertex of each block
    std::vector<PetscInt> local_columns;              ///< local vertex of each block
    std::vector<PetscInt> diagonal;                   ///< block of each owned vertex with itself
    std::vector<std::array<PetscInt, 9>> of_element;  ///< block that corners (a, b) add to, or -1
    std::vector<Eigen::Matrix3d> blocks;
  };

  void make_rows();
  void make_assembled();
  void make_shell();
  void assemble(bool positive);
  void add_elements(const ElementStiffness& stiffness, double factor);
  void make_diagonal();
  void add_diagonals(const ElementStiffness& stiffness, double factor);
  void invert_diagonal();
  void multiply(Vec in, Vec out);
  /// Of all ranks; 1 where every direction is held. Collective. @param own_sum of the diagonal of the owned vertices
  double mean_of_diagonal(double own_sum) const;
  PetscInt owned() const { return elements_.membrane().particles.owned; }

  const PrismElements& elements_;
  Choice<TangentMatrix> mat_type_;
  std::vector<Eigen::Matrix3d> projectors_;
  std::vector<PetscInt> constrained_;  ///< local vertices whose projector is not the identity
  bool any_constrained_ = false;       ///< on any rank

  std::unique_ptr<ElementStiffness> stiffness_;
  MetricStiffness positive_;                  ///< in its place in a positive tangent
  const ElementStiffness* in_use_ = nullptr;  ///< one of the two
  MetricStiffness lagged_;
  double lagged_factor_ = 0;
  std::vector<Eigen::Matrix3d> vertex_blocks_;  ///< of the owned vertices [N/m]

  Rows rows_;                              ///< of an assembled matrix
  double held_ = 0;                        ///< s of a shell [N/m]
  Field argument_;                         ///< of a product of the shell
  Eigen::Matrix3Xd product_;               ///< likewise, (3 x local)
  std::vector<Eigen::Matrix3d> diagonal_;  ///< of the shell's owned vertices, or none until somebody asks
  std::vector<Eigen::Matrix3d> inverse_;   ///< of these blocks, when last asked for
  MatHandle matrix_;
};

}  // namespace pellicle
