#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/handle.h"
#include "parallel/collective.h"
#include "solvers/interface_factor.h"
#include "solvers/low_rank_system.h"
#include "solvers/mumps_factor.h"
#include "solvers/rank_interface.h"
#include "solvers/tangent.h"

namespace pellicle {
inline namespace solvers {

/// A = T + G C G^T of a LowRankSystem, factorised: T = L D L^T by MUMPS, the columns by Woodbury's formula. As a
/// preconditioner it is A's inverse, whether T alone is positive definite or not, so that conjugate gradients need an
/// iteration or two on any mesh. D has T's inertia (numbers of positive and negative eigenvalues), from which that of A
/// follows (Haynsworth, Determination of the inertia of a partitioned Hermitian matrix, Linear Algebra Appl. 1, 1968):
/// for the bordered matrix M = [T, G; G^T, -C^-1]
///
///     In(M) = In(T) + In(-C^-1 - G^T T^-1 G) = In(-C^-1) + In(A).
///
/// Of columns that are held C^-1 is 0: then M is A's, and the inertia A's, where x is orthogonal to them.
///
/// Of several ranks each eliminates its inner vertices, and what is left of T, on the interface between them, every
/// rank factorises by itself, as in Substructures: the result of MUMPS across ranks depends on which message arrives
/// first, and would differ in its last digits from run to run. T's inertia is the sum of those of all the parts' D.
class TangentFactor {
 public:
  /// To be called when a run begins that may need a factor. @throws Error if MUMPS is to order by PORD on several
  /// ranks, which ends the program on some matrices with a border
  static void check_options(MPI_Comm comm, const std::string& prefix);

  /// Collective. @param tangent of which T is the matrix, not a shell. Both must outlive the factor.
  /// @param prefix of options, such as "prism_": of MUMPS (`-prism_mat_mumps_icntl_7`) and of the iterations
  TangentFactor(const Tangent& tangent, const LowRankSystem& system, const std::string& prefix);
  TangentFactor(const TangentFactor&) = delete;  // PETSc's preconditioner points to this object.
  TangentFactor& operator=(const TangentFactor&) = delete;

  /// Factorises the present values. Collective. @returns how many eigenvalues of A are negative, or nothing where it is
  /// singular
  std::optional<int> renew();

  /// To be called when the tangent has a new pattern.
  void forget_pattern() { inner_factor_.reset(); }

  /// Conjugate gradients on A, preconditioned with the inverse that A had at the last renewal.
  KSP solver() const { return solver_; }

 private:
  /// Where a block of T goes.
  enum class Target { none, inner, interface };

  static PetscErrorCode apply_callback(PC pc, Vec in, Vec out);
  void apply(Vec in, Vec out);
  void make_pattern();
  void fill();
  void solve(const double* load, double* solution);
  Eigen::MatrixXd sum_of_ranks(const Eigen::MatrixXd& own) const;

  const Tangent& tangent_;
  const LowRankSystem& system_;
  std::string prefix_;
  std::vector<Target> targets_;  ///< of the blocks as the tangent passes them on
  RankInterface interface_;      ///< of vertices
  std::unique_ptr<MumpsFactor> inner_factor_;
  std::unique_ptr<InterfaceFactor> interface_factor_;
  std::vector<double> own_entries_;  ///< this rank's, of the interface's matrix
  Gatherer all_entries_;
  Eigen::VectorXd values_;                       ///< of the inner vertices, then of their border
  Eigen::VectorXd interface_values_;             ///< of all its vertices
  Eigen::MatrixXd influence_;                    ///< T^-1 G of the columns that count, rows of the owned vertices
  Eigen::PartialPivLU<Eigen::MatrixXd> border_;  ///< of C^-1 + G^T T^-1 G
  KspHandle solver_;
};

}  // namespace solvers
}  // namespace pellicle
