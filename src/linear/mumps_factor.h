#pragma once

#include <petscsys.h>  // before petscblaslapack.h, which does not include what it needs

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "base/namespaces.h"

namespace pellicle::linear {

/// L D L^T of the inner unknowns i of a symmetric, possibly indefinite matrix of points with three unknowns each, by
/// MUMPS on this rank alone, and the Schur complement on the other unknowns, the border b:
///
///     A = [A_ii, A_ib; A_bi, A_bb], complement: A_bb - A_bi A_ii^-1 A_ib.
class MumpsFactor {
 public:
  /// Orders the unknowns for elimination.
  /// @param rows, columns of the entries, from 1; repeated entries are summed, and only one of an entry and its
  /// transpose is given
  /// @param size of A @param border number of its last unknowns that are the border
  /// @param prefix of options: `-<prefix>mat_mumps_icntl_7`, `-<prefix>mat_mumps_cntl_1`
  /// @throws Error with MUMPS' message
  MumpsFactor(std::vector<int> rows, std::vector<int> columns, int size, int border, const std::string& prefix);
  ~MumpsFactor();
  MumpsFactor(const MumpsFactor&) = delete;
  MumpsFactor& operator=(const MumpsFactor&) = delete;

  /// Values of the entries, in their order; to be set before `refresh`.
  std::vector<double>& values() { return values_; }

  /// Factorises the present values. @returns whether A_ii is regular, and there was memory for it
  bool refresh();

  int size_of_border() const { return border_; }
  /// Number of negative eigenvalues of A_ii.
  int negative() const;
  /// Lower half of the complement: entry (row, column) has the place row + column size_of_border().
  const std::vector<double>& complement() const { return complement_; }

  /// Eliminates the inner unknowns. @param load of all unknowns, the border's last, set to the reduced load
  void reduce(Eigen::VectorXd& load);
  /// Solves for the inner unknowns after `reduce`. @param solution of all unknowns, the border's, last, given
  void expand(Eigen::VectorXd& solution);

 private:
  struct Instance;
  void run(int job);
  void throw_if_failed(const char* job) const;
  void solve(int phase);
  std::vector<int> order() const;
  bool is_empty() const { return size_ == border_; }

  int size_;
  int border_;
  std::vector<int> rows_;
  std::vector<int> columns_;
  std::vector<double> values_;
  std::vector<int> border_unknowns_;  ///< from 1
  std::vector<double> complement_;
  std::vector<double> border_values_;
  std::unique_ptr<Instance> mumps_;
};

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
