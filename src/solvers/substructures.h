#pragma once

#include <petscksp.h>

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "parallel/collective.h"
#include "solvers/rank_interface.h"

namespace pellicle {
inline namespace solvers {

/// The inverse of a symmetric positive definite matrix whose rows are shared out among ranks, by substructuring
/// (Przemieniecki, Matrix structural analysis of substructures, AIAA Journal 1, 1963). Each rank factorises what its
/// inner unknowns are coupled with (RankInterface), by CHOLMOD, and so eliminates them; what is left, a small dense
/// matrix of the interface's unknowns, every rank factorises whole. Sums over ranks go from the first to the last: the
/// result does not depend on whose message arrives first.
class Substructures {
 public:
  Substructures();
  ~Substructures();
  Substructures(const Substructures&) = delete;  // PETSc's preconditioner points to this object.
  Substructures& operator=(const Substructures&) = delete;

  /// Makes the preconditioner the inverse of its matrix, of type MATAIJ: a PCSHELL, which the user's options may
  /// replace. This object must outlive the preconditioner.
  void precondition(PC pc);

  /// To be called when the matrix has a new pattern of entries.
  void forget_pattern();

  /// Takes a matrix' present values. Collective. @returns whether it is positive definite, the same on every rank
  bool renew(Mat matrix);

  /// Collective. @param in, out shared out as the matrix' rows
  void solve(Vec in, Vec out);

 private:
  class Factor;
  /// Values of all ranks that are added to the interface's matrix, in their order.
  struct Entries {
    std::vector<int> rows;
    std::vector<int> columns;
    std::vector<double> own;  ///< values of this rank
    Gatherer all;
  };
  void find_pattern(Mat matrix);
  static Entries gathered_pattern(MPI_Comm comm, const std::vector<int>& rows, const std::vector<int>& columns);
  void add_to_interface(const Entries& entries, double factor);

  RankInterface interface_;
  std::vector<PetscInt> place_;  ///< of each entry of this rank's rows, where it goes, or -1: nowhere
  std::unique_ptr<Factor> inner_factor_;
  Entries entries_;         ///< of the matrix
  Entries complements_;     ///< what the elimination of the inner unknowns takes off
  Eigen::MatrixXd matrix_;  ///< of the interface, its lower half, then its Cholesky factor
  std::vector<double> gathered_;
  Eigen::VectorXd inner_values_;
  Eigen::VectorXd interface_values_;
};

}  // namespace solvers
}  // namespace pellicle
