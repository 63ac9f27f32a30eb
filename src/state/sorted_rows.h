#pragma once

#include <cstddef>
#include <vector>

#include "parallel/records.h"
#include "parallel/route.h"

namespace pellicle::state {

/// Sorts rows by their ids over all ranks: those of the least ids go to rank 0, and so on. Ranks may have none, before
/// and after.
class SortedRows {
 public:
  /// Collective. @param ids of this rank's rows, unique over all ranks, not negative
  SortedRows(MPI_Comm comm, const std::vector<PetscInt>& ids);

  /// The rows of this rank after sorting. Collective.
  Records sorted(const Records& rows) const { return route_.send(rows).of_items(order_); }
  /// Sorts values of a plain type, `columns` for each row.
  template <class Value>
  std::vector<Value> sorted(const std::vector<Value>& values, int columns = 1) const {
    return sorted(Records::of(values, count_, static_cast<std::size_t>(columns))).template as<Value>();
  }

 private:
  PetscInt count_;  ///< number of this rank's rows before sorting
  Route route_;
  std::vector<PetscInt> order_;  ///< of the arriving rows
};

/// Fetches rows by their ids from other ranks; several ranks may fetch the same row.
class RowsOfIds {
 public:
  /// Collective. @param ids of the rows of this rank; they ascend over all ranks
  /// @throws Error, on all ranks, if there is no row of an id
  RowsOfIds(MPI_Comm comm, const std::vector<PetscInt>& ids, const std::vector<PetscInt>& wanted);

  /// The values of the wanted ids. Collective.
  /// @param values of the rows of this rank, `columns` a row
  template <class Value>
  std::vector<Value> of(const std::vector<Value>& values, int columns = 1) const {
    const Records rows = Records::of(values, count_, static_cast<std::size_t>(columns));
    return route_.send_back(rows.of_items(asked_)).template as<Value>();
  }

 private:
  PetscInt count_;  ///< number of this rank's rows
  Route route_;
  std::vector<PetscInt> asked_;  ///< this rank's rows that others fetch
};

}  // namespace pellicle::state
