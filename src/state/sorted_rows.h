#pragma once

#include <cstddef>
#include <vector>

#include "parallel/records.h"
#include "parallel/route.h"

namespace pellicle {
inline namespace state {

/// The way of rows to the order of their ids: the rows of the least ids come to rank 0, and so on. Ranks may have none,
/// before and after.
class SortedRows {
 public:
  /// Collective. @param ids of this rank's rows, unique over all ranks, not negative
  SortedRows(MPI_Comm comm, const std::vector<PetscInt>& ids);

  /// The rows that this rank has in that order. Collective.
  Records sorted(const Records& rows) const { return route_.send(rows).of_items(order_); }
  /// The same with values of a plain type, `columns` a row.
  template <class Value>
  std::vector<Value> sorted(const std::vector<Value>& values, int columns = 1) const {
    return sorted(Records::of(values, count_, static_cast<std::size_t>(columns))).template as<Value>();
  }

 private:
  PetscInt count_;  ///< of the rows before
  Route route_;
  std::vector<PetscInt> order_;  ///< of what arrives
};

/// The way to the rows of the ids that this rank wants; others may want them, too.
class RowsOfIds {
 public:
  /// Collective. @param ids of the rows of this rank; they rise over all ranks
  /// @throws Error, on all ranks, when there is no row of an id
  RowsOfIds(MPI_Comm comm, const std::vector<PetscInt>& ids, const std::vector<PetscInt>& wanted);

  /// What belongs to the wanted ids. Collective.
  /// @param values of the rows of this rank, `columns` a row
  template <class Value>
  std::vector<Value> of(const std::vector<Value>& values, int columns = 1) const {
    const Records rows = Records::of(values, count_, static_cast<std::size_t>(columns));
    return route_.send_back(rows.of_items(asked_)).template as<Value>();
  }

 private:
  PetscInt count_;  ///< of the rows of this rank
  Route route_;
  std::vector<PetscInt> asked_;  ///< rows of this rank
};

}  // namespace state
}  // namespace pellicle
