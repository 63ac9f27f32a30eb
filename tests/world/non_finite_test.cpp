#include "world/non_finite.h"

#include <gtest/gtest.h>

#include <limits>

namespace pellicle::non_finite_test {
namespace {

TEST(NonFinite, TheFirstOfAnyRankIsNamedOnAll) {
  int rank = 0;
  int ranks = 1;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  const bool is_last = rank == ranks - 1;
  const std::vector<double> sound{1, -2, 0, std::numeric_limits<double>::max()};
  std::vector<double> broken = sound;
  broken[2] = is_last ? std::numeric_limits<double>::quiet_NaN() : 0;
  std::vector<double> infinite = sound;
  infinite[0] = rank == 0 ? -std::numeric_limits<double>::infinity() : 0;
  const auto words = [](const std::vector<double>& position, const std::vector<double>& velocity) {
    return non_finite(MPI_COMM_WORLD,
                      {{"position", position.data(), position.size()}, {"velocity", velocity.data(), velocity.size()}});
  };
  EXPECT_EQ(words(sound, sound), "");
  EXPECT_EQ(words(broken, infinite), "the position is not finite");
  EXPECT_EQ(words(sound, infinite), "the velocity is not finite");
  EXPECT_EQ(words({}, broken), "the velocity is not finite");
}

}  // namespace
}  // namespace pellicle::non_finite_test
