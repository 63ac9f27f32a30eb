#pragma once

#include <mpi.h>
#include <petscsys.h>

#include <Eigen/Core>
#include <vector>

#include "parallel/collective.h"

namespace pellicle::linear {

/// Interface between the ranks that share a symmetric matrix, for substructuring: a row belongs to the interface if it
/// is coupled with a row of an earlier rank, and is an inner row otherwise. So inner rows are coupled with their rank's
/// rows and with the interface alone. The interface's rows are numbered from 0 over all ranks.
class RankInterface {
 public:
  RankInterface() = default;

  /// Collective. @param first, owned rows of this rank @param later rows of later ranks that are coupled with these
  RankInterface(MPI_Comm comm, PetscInt first, PetscInt owned, const std::vector<PetscInt>& later);

  int size() const { return static_cast<int>(rows_.size()); }
  /// Inner rows of this rank, counted from its first row.
  const std::vector<PetscInt>& inner() const { return inner_; }
  /// Interface rows of this rank, counted from its first row, and the number of the first of them in the interface.
  const std::vector<PetscInt>& own() const { return own_; }
  int own_first() const { return own_first_; }
  /// Number in the interface of a row of this rank, or of a coupled row of a later rank; -1 for an inner row.
  int number(PetscInt row) const;
  /// Number of an inner row of this rank among its inner rows.
  int inner_number(PetscInt row) const { return number_[row - first_]; }

  /// Sets the border, the interface rows coupled with this rank's inner rows. Collective.
  /// @param border numbers in the interface, ascending @param width number of values of each row when loads are summed
  void set_border(std::vector<int> border, int width);
  /// Numbers in the interface of the border's rows, ascending.
  const std::vector<int>& border() const { return border_; }

  /// Sums over all ranks, from the first to the last, the loads on the interface. Collective.
  /// @param own values of all of this rank's rows, of which the interface rows are used
  /// @param on_border contribution of this rank's inner rows to their border
  void sum(const double* own, const double* on_border, Eigen::VectorXd& result);

 private:
  MPI_Comm comm_ = MPI_COMM_NULL;
  PetscInt first_ = 0;
  std::vector<PetscInt> rows_;  ///< of all ranks, ascending
  std::vector<PetscInt> inner_;
  std::vector<PetscInt> own_;
  int own_first_ = 0;
  std::vector<int> number_;  ///< of each row of this rank: among the inner rows, or -1 - number in the interface
  std::vector<int> border_;
  int width_ = 1;
  std::vector<int> loaded_;  ///< interface row of each load of all ranks
  std::vector<double> loads_;
  std::vector<double> all_loads_;
  Gatherer gatherer_;
};

}  // namespace pellicle::linear
