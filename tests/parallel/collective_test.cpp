#include "parallel/collective.h"

#include <gtest/gtest.h>

namespace pellicle {
namespace {

struct Collective : ::testing::Test {
  Collective() {
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  }
  int rank = 0;
  int ranks = 1;
};

TEST_F(Collective, AnyRankIsEnough) {
  EXPECT_TRUE(on_any_rank(MPI_COMM_WORLD, rank == ranks - 1));
  EXPECT_FALSE(on_any_rank(MPI_COMM_WORLD, false));
}

TEST_F(Collective, ValuesComeRankAfterRank) {
  struct Pair {
    int rank;
    double value;
  };
  const std::vector<Pair> all =
      of_all_ranks(MPI_COMM_WORLD, std::vector<Pair>(static_cast<std::size_t>(rank), {rank, 0.5 * rank}));
  std::size_t next = 0;
  ASSERT_EQ(all.size(), static_cast<std::size_t>(ranks * (ranks - 1) / 2));
  for (int from = 0; from < ranks; ++from) {
    for (int k = 0; k < from; ++k, ++next) {  // Of rank 0 nothing.
      EXPECT_EQ(all[next].rank, from);
      EXPECT_EQ(all[next].value, 0.5 * from);
    }
  }
}

}  // namespace
}  // namespace pellicle
