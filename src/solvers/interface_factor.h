#pragma once

#include <petscsys.h>  // before petscblaslapack.h, which does not include what it needs

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "solvers/mumps_factor.h"

namespace pellicle {
inline namespace solvers {

/// L D L^T of a symmetric matrix of points, three unknowns each, which need not be positive definite: of the interface
/// between ranks, where each rank's border is dense. By LAPACK's `sytrf` (Bunch and Kaufman, Math. Comp. 31, 1977)
/// where there are as many entries as in a dense half, as of a few ranks, else by MUMPS. On 1,107 unknowns LAPACK takes
/// 14 ms, MUMPS 38.
class InterfaceFactor {
 public:
  /// @param rows, columns, prefix as of MumpsFactor; size of the matrix
  InterfaceFactor(std::vector<int> rows, std::vector<int> columns, int size, const std::string& prefix);

  /// Of the entries, in their order; to be set before a renewal.
  std::vector<double>& values() { return sparse_ ? sparse_->values() : values_; }

  /// Factorises the present values. @returns whether the matrix is regular, and there was memory for it
  bool renew();

  /// How many eigenvalues are negative.
  int negative() const;

  /// @param values right-hand side, and then the solution
  void solve(Eigen::VectorXd& values);

 private:
  std::unique_ptr<MumpsFactor> sparse_;  ///< null: dense
  std::vector<double> values_;
  std::vector<std::size_t> place_;  ///< of each value in the matrix
  Eigen::MatrixXd matrix_;          ///< its lower half, then LAPACK's factors
  std::vector<PetscBLASInt> pivots_;
  std::vector<double> workspace_;
};

}  // namespace solvers
}  // namespace pellicle
