#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/handle.h"
#include "energies/tangent.h"
#include "linear/low_rank_system.h"
#include "linear/mumps_factor.h"
#include "linear/rank_interface.h"
#include "parallel/collective.h"

namespace pellicle::energies {

/// A = T + G C G^T of a LowRankSystem, factorised: T = L D L^T by MUMPS, the columns by Woodbury's formula. As a
/// preconditioner it is A's inverse, whether T alone is positive definite or not, so that conjugate gradients need an
/// iteration or two on any mesh. D has T's inertia (numbers of positive and negative eigenvalues), from which that of A
/// follows (Haynsworth, Determination of the inertia of a partitioned Hermitian matrix, Linear Algebra Appl. 1, 1968):
/// for the bordered matrix M = [T, G; G^T, -C^-1]
///
///     In(M) = In(T) + In(-C^-1 - G^T T^-1 G) = In(-C^-1) + In(A).
///
/// For constrained columns C^-1 is 0, and the inertia is that of A on the space orthogonal to them.
///
/// Each of several ranks eliminates its inner vertices, and every rank factorises the Schur complement of the interface
/// by itself, as in Substructures: MUMPS across ranks depends on the order of messages, so that results would differ in
/// their last digits from run to run. T's inertia is the sum of those of all parts' D.
class TangentFactor {
 public:
  /// Checks the options at the beginning of a run that may need a factor. @throws Error if MUMPS is to order by PORD on
  /// several ranks, which crashes on some matrices with a border
  static void check_options(MPI_Comm comm, const std::string& prefix);

  /// Collective. @param tangent whose matrix is T, not a shell; tangent and system must outlive the factor
  /// @param prefix of options, such as "prism_": of MUMPS (`-prism_mat_mumps_icntl_7`) and of the iterations
  TangentFactor(const Tangent& tangent, const LowRankSystem& system, const std::string& prefix);
  TangentFactor(const TangentFactor&) = delete;  // PETSc's preconditioner points to this object.
  TangentFactor& operator=(const TangentFactor&) = delete;

  /// Factorises the present values. Collective. @returns number of negative eigenvalues of A; none if it is singular
  std::optional<int> refresh();

  /// Lets the factor be made anew. Must be called when the tangent has a new pattern.
  void forget_pattern() { inner_factor_.reset(); }

  /// Conjugate gradients on A, preconditioned with the inverse that A had at the last renewal.
  KSP solver() const { return solver_; }

 private:
  /// Matrix to which a block of T belongs.
  enum class Target { none, inner, interface };

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
  std::vector<double> own_entries_;  ///< this rank's entries of the interface's matrix
  Gatherer all_entries_;
  Eigen::VectorXd values_;                       ///< of the inner vertices, then of their border
  Eigen::VectorXd interface_values_;             ///< of all vertices of the interface
  Eigen::MatrixXd influence_;                    ///< T^-1 G of the used columns, rows of the owned vertices
  Eigen::PartialPivLU<Eigen::MatrixXd> border_;  ///< of C^-1 + G^T T^-1 G
  KspHandle solver_;
};

}  // namespace pellicle::energies
