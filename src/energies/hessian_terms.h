#pragma once

#include <petscsys.h>

#include <Eigen/Core>
#include <vector>

#include "parallel/field.h"

namespace pellicle::energies {

/// Term of a Hessian that acts on the difference of two vertices alone, n n^T + across I, such as a spring's: n lies
/// along the line through both, so that n n^T does no work when both turn together.
struct DifferenceTerm {
  PetscInt a = 0;  ///< local vertex
  PetscInt b = 0;
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< n; length: root of the stiffness [(N/m)^(1/2)]
  double across = 0;                                    ///< [N/m]

  /// Block of each of both vertices with itself; minus that of one with the other.
  Eigen::Matrix3d block() const {
    Eigen::Matrix3d result = direction * direction.transpose();
    result.diagonal().array() += across;
    return result;
  }
};

/// Part of a symmetric Hessian that couples vertices alike in all directions: a number e for each pair of vertices, in
/// rows of the owned vertices, each with its diagonal and the columns after it. With normals n the blocks are e (I +
/// along n_i n_j^T).
struct NumberRows {
  std::vector<PetscInt> offsets{0};  ///< first entry of each row, (owned + 1)
  std::vector<PetscInt> columns;     ///< local vertices, ascending in a row
  std::vector<double> entries;       ///< [N/m]
  double along = 0;                  ///< coupling along normals over that in all directions
  Field normals;                     ///< of the local vertices, if `along` is not 0

  /// Block of vertex i with the vertex of an entry of its row.
  Eigen::Matrix3d block(PetscInt i, std::size_t entry) const {
    Eigen::Matrix3d result = entries[entry] * Eigen::Matrix3d::Identity();
    if (along != 0) {
      result += along * entries[entry] * normals.vector(i) * normals.vector(columns[entry]).transpose();
    }
    return result;
  }
};

/// Receives a Hessian term by term: cheaper than block by block, as most blocks need far fewer than nine numbers.
class HessianTerms {
 public:
  /// @param owned vertices of this rank
  explicit HessianTerms(PetscInt owned) : owned_(owned) {}
  virtual ~HessianTerms() = default;

  /// Adds a block (3 x 3) to an owned vertex's row. @param row, column local vertices
  virtual void add_block(PetscInt row, PetscInt column, const Eigen::Matrix3d& block) = 0;
  /// Whether blocks of two different vertices are needed; if not, they may be left out.
  virtual bool wants_off_diagonal() const { return true; }
  /// Adds terms of which at least one vertex is owned; block by block unless overridden.
  virtual void add_differences(const std::vector<DifferenceTerm>& terms);
  /// Adds rows of numbers; block by block unless overridden.
  virtual void add_numbers(const NumberRows& rows);

 protected:
  /// Adds the blocks of a term.
  void add_blocks(const DifferenceTerm& term);
  /// Adds the two blocks of an owned vertex and the vertex of an entry of its row.
  void add_blocks(const NumberRows& rows, PetscInt row, std::size_t entry);

  const PetscInt owned_;
};

/// Passes the blocks of a Hessian to a function of an owned row, a column and a block.
template <class Take>
class TakenBlocks : public HessianTerms {
 public:
  TakenBlocks(PetscInt owned, const Take& take, bool wants_off_diagonal = true)
      : HessianTerms(owned), take_(take), wants_off_diagonal_(wants_off_diagonal) {}
  void add_block(PetscInt row, PetscInt column, const Eigen::Matrix3d& block) override { take_(row, column, block); }
  bool wants_off_diagonal() const override { return wants_off_diagonal_; }

 private:
  const Take& take_;
  bool wants_off_diagonal_;
};

}  // namespace pellicle::energies
