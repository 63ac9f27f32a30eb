#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <optional>
#include <string>
#include <vector>

#include "base/handle.h"
#include "solvers/low_rank_system.h"
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
/// Every rank gathers the whole of T and factorises it by itself: the result of MUMPS across ranks depends on which
/// message arrives first, and would differ in its last digits from run to run.
class TangentFactor {
 public:
  /// Collective. @param tangent of which T is the matrix, not a shell. Both must outlive the factor.
  /// @param prefix of options, such as "prism_": of MUMPS (`-prism_mat_mumps_icntl_7`) and of the iterations
  TangentFactor(const Tangent& tangent, const LowRankSystem& system, const std::string& prefix);
  TangentFactor(const TangentFactor&) = delete;  // PETSc's preconditioner points to this object.
  TangentFactor& operator=(const TangentFactor&) = delete;

  /// Factorises the present values. Collective. @returns how many eigenvalues of A are negative, or nothing where it is
  /// singular
  std::optional<int> renew();

  /// To be called when the tangent has a new pattern.
  void forget_pattern() { factor_ = {}; }

  /// Conjugate gradients on A, preconditioned with the inverse that A had at the last renewal.
  KSP solver() const { return solver_; }

 private:
  static PetscErrorCode apply_callback(PC pc, Vec in, Vec out);
  void apply(Vec in, Vec out);
  void make_pattern();
  void fill();
  void gather(const double* own, std::vector<double>& whole, int width, const std::vector<int>& counts) const;

  const Tangent& tangent_;
  const LowRankSystem& system_;
  std::string prefix_;
  int ranks_ = 1;
  std::vector<int> vertex_counts_;  ///< of each rank
  std::vector<int> block_counts_;   ///< in the upper half of each rank's rows
  std::vector<PetscInt> rows_;      ///< global vertex of the blocks of all ranks
  std::vector<PetscInt> columns_;
  std::vector<double> own_blocks_;  ///< by columns [N/m]
  std::vector<double> blocks_;      ///< of all ranks
  MatHandle whole_;                 ///< T
  MatHandle factor_;
  VecHandle right_hand_side_;
  VecHandle solution_;
  Eigen::MatrixXd influence_;                    ///< T^-1 G of the columns that count, whole
  Eigen::PartialPivLU<Eigen::MatrixXd> border_;  ///< of C^-1 + G^T T^-1 G
  KspHandle solver_;
};

}  // namespace solvers
}  // namespace pellicle
