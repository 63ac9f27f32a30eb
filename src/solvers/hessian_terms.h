#pragma once

#include <petscsys.h>

#include <Eigen/Core>
#include <vector>

namespace pellicle {
inline namespace solvers {

/// Of a Hessian what acts on the difference of two vertices alone, n n^T + across I, as of a spring: n lies along the
/// line through both. Its part along that line does no work when both turn together.
struct DifferenceTerm {
  PetscInt a = 0;  ///< local vertex
  PetscInt b = 0;
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< n, the root of its stiffness long [(N/m)^(1/2)]
  double across = 0;                                    ///< [N/m]
};

/// Of a symmetric Hessian what couples vertices in all directions alike, a number for each pair of vertices: rows of
/// the owned vertices, each of its diagonal and the columns after it.
struct NumberRows {
  std::vector<PetscInt> offsets{0};  ///< first entry of each row, (owned + 1)
  std::vector<PetscInt> columns;     ///< local vertices, ascending in a row
  std::vector<double> entries;       ///< [N/m]
};

/// Takes a Hessian term by term: cheaper than block by block, as most blocks have much less in them than nine numbers.
class HessianTerms {
 public:
  /// @param owned vertices of this rank
  explicit HessianTerms(PetscInt owned) : owned_(owned) {}
  virtual ~HessianTerms() = default;

  /// A block (3 x 3) of an owned vertex's row. @param row, column local vertices
  virtual void add_block(PetscInt row, PetscInt column, const Eigen::Matrix3d& block) = 0;
  /// Terms of which one vertex at least is owned. Block by block unless overridden.
  virtual void add_differences(const std::vector<DifferenceTerm>& terms);
  /// Likewise.
  virtual void add_numbers(const NumberRows& rows);

 protected:
  PetscInt owned() const { return owned_; }
  /// Adds the blocks of a term.
  void add_blocks(const DifferenceTerm& term);
  /// Adds the blocks of an owned vertex with another one, and of that with it.
  void add_blocks(PetscInt row, PetscInt column, double number);

 private:
  PetscInt owned_;
};

/// Hands a Hessian on block by block, to a function of an owned row, a column and a block.
template <class Take>
class TakenBlocks : public HessianTerms {
 public:
  TakenBlocks(PetscInt owned, const Take& take) : HessianTerms(owned), take_(take) {}
  void add_block(PetscInt row, PetscInt column, const Eigen::Matrix3d& block) override { take_(row, column, block); }

 private:
  const Take& take_;
};

}  // namespace solvers
}  // namespace pellicle
