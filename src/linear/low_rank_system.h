#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <string>
#include <utility>
#include <vector>

#include "base/handle.h"
#include "linear/ksp.h"
#include "linear/low_rank.h"

namespace pellicle::linear {

/// The system A x = b with A = T + G C G^T: T is sparse or matrix-free, G C G^T a LowRank. The preconditioner is made
/// from T. A solver without iterations (preonly) solves with T alone, and the columns are added by Woodbury's formula.
///
/// Columns may be constrained: then P A P x = P b, with the projection P on the space orthogonal to them. Conjugate
/// gradients then need A to be positive definite in that space only.
class LowRankSystem {
 public:
  /// Makes the solver, as make_ksp does. Collective.
  /// @param sparse T, must outlive the system
  /// @param columns number of the columns of G, may be 0
  LowRankSystem(Mat sparse, int columns, const std::string& prefix, const KspDefaults& defaults);
  LowRankSystem(const LowRankSystem&) = delete;  // The matrix points to this object.
  LowRankSystem& operator=(const LowRankSystem&) = delete;

  Mat sparse() const { return sparse_; }
  /// A, or P A P with constrained columns.
  Mat matrix() const { return count() > 0 ? Mat(matrix_) : sparse_; }
  KSP solver() const { return solver_; }
  int count() const { return static_cast<int>(low_rank_.count()); }
  /// Owned rows of T.
  Eigen::Index rows() const { return rows_; }
  const LowRank& low_rank() const { return low_rank_; }

  /// Sets G C G^T after T has got new values. Collective. @param low_rank with `count` columns
  void update(LowRank low_rank);

  /// Holds columns from now on; not with a solver that works with T alone. Collective.
  void hold(std::vector<int> columns) {
    constrained_ = std::move(columns);
    make_basis();
  }
  const std::vector<int>& constrained() const { return constrained_; }
  /// Q, (owned rows x constrained columns), orthonormal over all ranks, of the constrained columns G = Q R.
  const Eigen::MatrixXd& held_basis() const { return basis_; }
  /// Cholesky factors of R^T R = G^T G; without success if the columns are linearly dependent.
  const Eigen::LLT<Eigen::MatrixXd>& held_products() const { return held_products_; }
  /// Replaces x by P x. Collective. @returns Q^T x
  Eigen::VectorXd project(Vec x) const;
  /// y = A x, also with constrained columns. Collective.
  void multiply_whole(Vec x, Vec y) const;

  /// Uses another solver of `matrix()` from now on; null: the own one.
  void use(KSP solver) { other_solver_ = solver; }
  /// Solves. Collective. @param need as for pellicle::solve
  LinearResult solve(Vec right_hand_side, Vec solution, const LinearNeed* need = nullptr);

  /// g_c.v of every column (the rows of the result) and every vector (its columns). Collective.
  Eigen::MatrixXd column_products(const std::vector<Vec>& vectors) const;

  /// Whether the solver works with T alone.
  bool solves_sparse_alone() const { return solves_sparse_alone_; }
  /// Makes the preconditioner from a matrix other than T from now on; not with a solver that works with T alone.
  void precondition_from(Mat matrix);
  /// Has the preconditioner made anew from T, which has got another pattern. Collective.
  void forget_pattern();

 private:
  LinearResult solve_by_woodbury(Vec right_hand_side, Vec solution);
  std::vector<KSP> solvers() const;
  void make_basis();
  void multiply(Vec x, Vec y);

  Mat sparse_;
  double rtol_;
  bool solves_sparse_alone_ = false;
  PetscInt rows_ = 0;
  LowRank low_rank_;
  std::vector<int> constrained_;
  Eigen::MatrixXd basis_;
  Eigen::LLT<Eigen::MatrixXd> held_products_;
  VecHandle projected_;
  MatHandle matrix_;  ///< if there are columns
  KspHandle solver_;
  KSP other_solver_ = nullptr;        ///< used in place of `solver_`
  std::vector<VecHandle> influence_;  ///< T^-1 g of the first columns, those solved for since the last update
};

}  // namespace pellicle::linear
