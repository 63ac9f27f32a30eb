#include "parallel/collective.h"

#include <gtest/gtest.h>

#include <Eigen/Core>

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

TEST_F(Collective, NumbersAreReduced) {
  EXPECT_EQ(sum_over_ranks(MPI_COMM_WORLD, rank + 1), ranks * (ranks + 1) / 2);
  EXPECT_EQ(sum_over_ranks(MPI_COMM_WORLD, 3'000'000'000LL), 3'000'000'000LL * ranks);
  EXPECT_EQ(max_over_ranks(MPI_COMM_WORLD, 0.5 * rank), 0.5 * (ranks - 1));
  EXPECT_EQ(min_over_ranks(MPI_COMM_WORLD, 0.5 * rank - 1), -1);
}

TEST_F(Collective, ValuesAreReducedEachByItself) {
  const std::array<double, 2> pair{1.0 * rank, -1.0 * rank};
  EXPECT_EQ(max_over_ranks(MPI_COMM_WORLD, pair), (std::array<double, 2>{ranks - 1.0, 0}));
  EXPECT_EQ(min_over_ranks(MPI_COMM_WORLD, pair), (std::array<double, 2>{0, 1.0 - ranks}));
  EXPECT_EQ(sum_over_ranks(MPI_COMM_WORLD, pair)[0], 0.5 * ranks * (ranks - 1));

  std::vector<double> values{1, 2.0 * rank};
  sum_over_ranks(MPI_COMM_WORLD, values);
  EXPECT_EQ(values, (std::vector<double>{1.0 * ranks, 1.0 * ranks * (ranks - 1)}));
  std::vector<int> none;
  max_over_ranks(MPI_COMM_WORLD, none);
  EXPECT_TRUE(none.empty());

  Eigen::Vector3d vector(rank, -rank, 1);
  min_over_ranks(MPI_COMM_WORLD, vector);
  EXPECT_EQ(vector, Eigen::Vector3d(0, 1 - ranks, 1));
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
