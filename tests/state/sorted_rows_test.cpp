#include "state/sorted_rows.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numeric>

#include "base/error.h"
#include "tests/support/solver_options.h"

namespace pellicle {
namespace {

/// Ids 3, 8, 13, ..., 98 in any order, dealt to the ranks but the first of several.
std::vector<PetscInt> own_ids() {
  std::vector<PetscInt> ids;
  for (PetscInt k = 0; k < 20; ++k) {
    const PetscInt shuffled = 7 * k % 20;
    const int rank = ranks() == 1 ? 0 : 1 + static_cast<int>(k) % (ranks() - 1);
    if (rank == this_rank()) {
      ids.push_back(3 + 5 * shuffled);
    }
  }
  return ids;
}

/// What belongs to an id.
std::vector<double> rows_for(const std::vector<PetscInt>& ids) {
  std::vector<double> rows;
  for (const PetscInt id : ids) {
    rows.insert(rows.end(), {0.25 * id, -1.0 * id});
  }
  return rows;
}

TEST(SortedRows, ComeInTheOrderOfTheirIds) {
  const std::vector<PetscInt> ids = own_ids();
  const SortedRows by_id(PETSC_COMM_WORLD, ids);
  const std::vector<PetscInt> sorted = by_id.sorted(ids);
  EXPECT_TRUE(std::is_sorted(sorted.begin(), sorted.end()));
  EXPECT_EQ(by_id.sorted(rows_for(ids), 2), rows_for(sorted));
  // Those of one rank lie before those of the next.
  std::array<PetscInt, 2> ends{sorted.empty() ? 1000 : sorted.front(), sorted.empty() ? -1 : sorted.back()};
  std::vector<PetscInt> all(2 * static_cast<std::size_t>(ranks()));
  MPI_Allgather(ends.data(), 2, MPIU_INT, all.data(), 2, MPIU_INT, PETSC_COMM_WORLD);
  PetscInt last = -1;
  for (std::size_t rank = 0; rank < all.size(); rank += 2) {
    if (all[rank + 1] >= 0) {
      EXPECT_LT(last, all[rank]);
      last = all[rank + 1];
    }
  }
  EXPECT_EQ(last, 98);
}

TEST(SortedRows, AreFoundByTheirIds) {
  const std::vector<PetscInt> ids = own_ids();
  const SortedRows by_id(PETSC_COMM_WORLD, ids);
  const std::vector<PetscInt> sorted = by_id.sorted(ids);
  const std::vector<PetscInt> wanted{98, 3, 53, 3, 48};  // the same on every rank
  EXPECT_EQ(RowsOfIds(PETSC_COMM_WORLD, sorted, wanted).of(rows_for(sorted), 2), rows_for(wanted));
  EXPECT_TRUE(RowsOfIds(PETSC_COMM_WORLD, sorted, {}).of(rows_for(sorted), 2).empty());
  for (const PetscInt absent : {0, 4, 99}) {
    const std::vector<PetscInt> some = this_rank() == 0 ? std::vector<PetscInt>{absent} : std::vector<PetscInt>{};
    EXPECT_THROW(RowsOfIds(PETSC_COMM_WORLD, sorted, some), Error) << absent;
  }
}

// Ids up to the last that there can be, evenly spread: each rank has one, in reverse order, and gets one.
TEST(SortedRows, MayHaveTheHighestIds) {
  const PetscInt last = std::numeric_limits<PetscInt>::max() - 1;
  const auto id_of = [last](PetscInt k) { return k == 0 ? last : last - last / ranks() * k - last / ranks() / 2; };
  const std::vector<PetscInt> ids{id_of(this_rank())};
  const std::vector<PetscInt> sorted = SortedRows(PETSC_COMM_WORLD, ids).sorted(ids);
  EXPECT_EQ(sorted, std::vector<PetscInt>{id_of(ranks() - 1 - this_rank())});
  const std::vector<PetscInt> wanted{last};
  EXPECT_EQ(RowsOfIds(PETSC_COMM_WORLD, sorted, wanted).of(rows_for(sorted), 2), rows_for(wanted));
}

}  // namespace
}  // namespace pellicle
