#pragma once

#include <petscksp.h>

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "linear/rank_interface.h"
#include "parallel/collective.h"

namespace pellicle::linear {

/// The inverse of a symmetric positive definite matrix whose rows are shared out among ranks, by substructuring
/// (Przemieniecki, Matrix structural analysis of substructures, AIAA Journal 1, 1963). Each rank eliminates its inner
/// unknowns (RankInterface) by CHOLMOD; the Schur complement, a small dense matrix of the interface's unknowns, is
/// factorised whole on every rank. Sums over ranks go from the first to the last, so that the result does not depend on
/// the order of messages.
class Substructures {
 public:
  Substructures();
  ~Substructures();
  Substructures(const Substructures&) = delete;  // PETSc's preconditioner points to this object.
  Substructures& operator=(const Substructures&) = delete;

  /// Sets a preconditioner to the inverse of its matrix, of type MATAIJ: a PCSHELL, which the user's options may
  /// replace. This object must outlive the preconditioner.
  void precondition(PC pc);

  /// Lets the preconditioner be made anew. Must be called when the matrix has a new pattern of entries.
  void forget_pattern();

  /// Factorises a matrix's present values. Collective. @returns whether it is positive definite, the same on every rank
  bool refresh(Mat matrix);

  /// Solves with the last factors. Collective. @param in, out distributed like the matrix's rows
  void solve(Vec in, Vec out);

 private:
  class Factor;
  /// Values of all ranks that are added to the interface's matrix, in their order.
  struct Entries {
    Entries() = default;
    Entries(MPI_Comm comm, const std::vector<int>& own_places)
        : places(of_all_ranks(comm, own_places)), own(own_places.size()), all(comm, own.size()) {}

    std::vector<int> places;  ///< in the matrix, by columns
    std::vector<double> own;  ///< values of this rank
    Gatherer all;
  };
  void find_pattern(Mat matrix);
  void add_to_interface(const Entries& entries, double factor);

  RankInterface interface_;
  std::vector<PetscInt> place_;  ///< target of each entry of this rank's rows; -1: unused
  std::unique_ptr<Factor> inner_factor_;
  Entries entries_;         ///< of the matrix
  Entries complements_;     ///< subtracted by the elimination of the inner unknowns
  Eigen::MatrixXd matrix_;  ///< lower half of the interface's matrix, then its Cholesky factor
  std::vector<double> gathered_;
  Eigen::VectorXd inner_values_;
  Eigen::VectorXd interface_values_;
};

}  // namespace pellicle::linear
