#pragma once

#include <mpi.h>
#include <petscsys.h>

#include <Eigen/Core>
#include <vector>

#include "parallel/collective.h"

namespace pellicle {
inline namespace solvers {

/// What couples the rows of a symmetric matrix that ranks share, as substructuring needs it: a row is of the interface
/// if it is coupled with one of an earlier rank, and an inner one otherwise. So inner rows are coupled with their
/// rank's rows and with those of the interface alone. The interface's rows are numbered from 0 over all ranks.
class RankInterface {
 public:
  RankInterface() = default;

  /// Collective. @param first, owned rows of this rank @param later rows of later ranks that these are coupled with
  RankInterface(MPI_Comm comm, PetscInt first, PetscInt owned, const std::vector<PetscInt>& later);

  int size() const { return static_cast<int>(rows_.size()); }
  /// Rows of this rank that are inner ones, counted from its first.
  const std::vector<PetscInt>& inner() const { return inner_; }
  /// The other ones, and the number of the first of them.
  const std::vector<PetscInt>& own() const { return own_; }
  int own_first() const { return own_first_; }
  /// Of a row of this rank, or a later rank's that one of these is coupled with: -1 for an inner row.
  int number(PetscInt row) const;
  /// Of an inner row of this rank among these.
  int inner_number(PetscInt row) const { return number_[row - first_]; }

  /// Says what this rank's inner rows are coupled with. Collective. @param border numbers, ascending
  /// @param width number of values of each row when loads are summed
  void set_border(const std::vector<int>& border, int width);
  const std::vector<int>& border() const { return border_; }

  /// Sums over all ranks, from the first to the last, the loads on the interface. Collective.
  /// @param own values of all of this rank's rows, of which those of the interface count
  /// @param on_border what this rank's inner rows do to their border
  void sum(const double* own, const double* on_border, Eigen::VectorXd& result);

 private:
  MPI_Comm comm_ = MPI_COMM_NULL;
  PetscInt first_ = 0;
  std::vector<PetscInt> rows_;  ///< of all ranks, ascending
  std::vector<PetscInt> inner_;
  std::vector<PetscInt> own_;
  int own_first_ = 0;
  std::vector<int> number_;  ///< of each row of this rank among the inner ones, or in the interface, from -1 down
  std::vector<int> border_;
  int width_ = 1;
  std::vector<int> loaded_;  ///< number for each load of all ranks
  std::vector<double> loads_;
  std::vector<double> all_loads_;
  Gatherer gatherer_;
};

}  // namespace solvers
}  // namespace pellicle
