#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "base/handle.h"
#include "solvers/ksp.h"

namespace pellicle {
inline namespace solvers {

/// A x = b with A = T + G C G^T: T sparse or matrix-free, G a few dense columns, C diagonal. A is MatCreateLRC's, T
/// what the preconditioner is made from. A solver without iterations (preonly) gets T alone, and the columns by
/// Woodbury.
class LowRankSystem {
 public:
  /// Makes the solver, as make_ksp does. Collective.
  /// @param sparse T, must outlive the system
  /// @param columns number of the columns of G, may be 0
  LowRankSystem(Mat sparse, int columns, const std::string& prefix, const KspDefaults& defaults);
  LowRankSystem(const LowRankSystem&) = delete;  // PETSc's matrix holds the columns' address.
  LowRankSystem& operator=(const LowRankSystem&) = delete;

  Mat sparse() const { return sparse_; }
  Mat matrix() const { return count() > 0 ? Mat(low_rank_) : sparse_; }
  KSP solver() const { return solver_; }
  int count() const { return static_cast<int>(columns_.cols()); }
  /// G, (owned rows x count).
  const Eigen::MatrixXd& columns() const { return columns_; }
  /// The diagonal of C.
  const Eigen::VectorXd& coefficients() const { return coefficients_; }

  /// Takes G and C for values of T that have just changed. Collective.
  void update(const Eigen::MatrixXd& columns, const Eigen::VectorXd& coefficients);

  /// From here on solves by another solver of `matrix()`; null: by its own.
  void use(KSP solver) { other_solver_ = solver; }
  /// Collective.
  LinearResult solve(Vec right_hand_side, Vec solution);

  /// g_c.v of every column, a row each, for some vectors, a column each. Collective.
  Eigen::MatrixXd column_products(const std::vector<Vec>& vectors) const;

  /// Whether the preconditioner may be made from another matrix than T; the solver that works with T alone may not.
  bool allows_other_preconditioning() const { return !solves_sparse_alone_; }
  void precondition_from(Mat matrix);

 private:
  LinearResult solve_by_woodbury(Vec right_hand_side, Vec solution);

  Mat sparse_;
  double rtol_;
  bool solves_sparse_alone_ = false;
  Eigen::MatrixXd columns_;
  Eigen::VectorXd coefficients_;
  MatHandle petsc_columns_;  ///< of the memory of `columns_`
  VecHandle petsc_coefficients_;
  MatHandle low_rank_;
  KspHandle solver_;
  KSP other_solver_ = nullptr;        ///< in use in its place
  std::vector<VecHandle> influence_;  ///< T^-1 g of the columns, as far as they are known for the present values
};

}  // namespace solvers
}  // namespace pellicle
