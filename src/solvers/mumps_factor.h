#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

namespace pellicle {
inline namespace solvers {

/// L D L^T of the inner unknowns i of a symmetric matrix of points, three unknowns each, which need not be positive
/// definite, by MUMPS on this rank alone, and what they leave to the others, its border b:
///
///     A = [A_ii, A_ib; A_bi, A_bb], complement: A_bb - A_bi A_ii^-1 A_ib.
class MumpsFactor {
 public:
  /// Orders the unknowns.
  /// @param rows, columns from 1, of entries that may come several times and are summed; of an entry and its mirror
  /// image only one must come
  /// @param size of A; the border are its last unknowns
  /// @param prefix of options: `-<prefix>mat_mumps_icntl_7`, `-<prefix>mat_mumps_cntl_1`
  /// @throws Error with MUMPS' words for it
  MumpsFactor(std::vector<int> rows, std::vector<int> columns, int size, int border, const std::string& prefix);
  ~MumpsFactor();
  MumpsFactor(const MumpsFactor&) = delete;
  MumpsFactor& operator=(const MumpsFactor&) = delete;

  /// Of the entries, in their order; to be set before a renewal.
  std::vector<double>& values() { return values_; }

  /// Factorises the present values. @returns whether A_ii is regular, and there was memory for it
  bool renew();

  int size_of_border() const { return border_; }
  /// How many eigenvalues of A_ii are negative.
  int negative() const;
  /// Its lower half column after column, one of which is size_of_border() long: (row, column) has the place row +
  /// column size_of_border().
  const std::vector<double>& complement() const { return complement_; }

  /// Eliminates the inner unknowns. @param load of all unknowns, the border's last, which becomes what is left to it
  void reduce(Eigen::VectorXd& load);
  /// To be called after a reduction. @param solution of the border, last, to which that of the inner unknowns comes
  void expand(Eigen::VectorXd& solution);

 private:
  struct Instance;
  void run(int job);
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

}  // namespace solvers
}  // namespace pellicle
