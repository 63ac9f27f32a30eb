#include "parallel/route.h"

#include <gtest/gtest.h>

namespace pellicle {
namespace {

struct RouteTest : ::testing::Test {
  RouteTest() {
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  }
  int rank = 0;
  int ranks = 1;
};

struct Letter {
  int from;
  int number;
};

TEST_F(RouteTest, ItemsArriveInTheOrderOfTheirSendersAndAnswersInTheirOwn) {
  // Rank r sends r letters to each rank, one rank after the other in turn, so that rank 0 sends none.
  std::vector<int> destinations;
  std::vector<Letter> letters;
  for (int number = 0; number < rank; ++number) {
    for (int to = ranks - 1; to >= 0; --to) {
      destinations.push_back(to);
      letters.push_back({rank, number});
    }
  }
  const Route route(MPI_COMM_WORLD, destinations);
  const std::vector<Letter> arrived = route.send(letters);
  ASSERT_EQ(route.sources().size(), ranks * (ranks - 1) / 2);
  std::size_t next = 0;
  std::vector<int> answers;
  for (int from = 0; from < ranks; ++from) {
    for (int number = 0; number < from; ++number, ++next) {
      EXPECT_EQ(route.sources()[next], from);
      EXPECT_EQ(arrived[next].from, from);
      EXPECT_EQ(arrived[next].number, number);
      answers.push_back(100 * number + rank);
    }
  }
  const std::vector<int> answered = route.send_back(answers);
  ASSERT_EQ(answered.size(), letters.size());
  for (std::size_t i = 0; i < letters.size(); ++i) {
    EXPECT_EQ(answered[i], 100 * letters[i].number + destinations[i]);
  }
}

TEST_F(RouteTest, RecordsWithoutBytesGoNowhere) {
  const Route route(MPI_COMM_WORLD, std::vector<int>(3, 0));
  const Records none = route.send(Records(0, 3));
  EXPECT_EQ(none.bytes(), 0u);
  EXPECT_EQ(none.count(), rank == 0 ? 3 * ranks : 0);
}

}  // namespace
}  // namespace pellicle
