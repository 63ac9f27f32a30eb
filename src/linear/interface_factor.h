#pragma once

#include <petscsys.h>  // before petscblaslapack.h, which does not include what it needs

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "linear/mumps_factor.h"

namespace pellicle::linear {

/// L D L^T of a symmetric, possibly indefinite matrix of points with three unknowns each: that of the interface between
/// ranks, where each rank's border is dense. By LAPACK's `sytrf` (Bunch and Kaufman, Math. Comp. 31, 1977) if there are
/// as many entries as in a dense half, as with few ranks, else by MUMPS. On 1,107 unknowns LAPACK takes 14 ms, MUMPS
/// 38.
class InterfaceFactor {
 public:
  /// @param rows, columns, prefix as for MumpsFactor @param size of the matrix
  InterfaceFactor(std::vector<int> rows, std::vector<int> columns, int size, const std::string& prefix);

  /// Values of the entries, in their order; to be set before `refresh`.
  std::vector<double>& values() { return sparse_ ? sparse_->values() : values_; }

  /// Factorises the present values. @returns whether the matrix is regular, and there was memory for it
  bool refresh();

  /// Number of negative eigenvalues.
  int negative() const;

  /// @param values right-hand side, and then the solution
  void solve(Eigen::VectorXd& values);

 private:
  std::unique_ptr<MumpsFactor> sparse_;  ///< null: dense
  std::vector<double> values_;
  std::vector<std::size_t> place_;  ///< index of each value in `matrix_`
  Eigen::MatrixXd matrix_;          ///< lower half of the matrix, then LAPACK's factors
  std::vector<PetscBLASInt> pivots_;
  std::vector<double> workspace_;
};

}  // namespace pellicle::linear
