#include <gtest/gtest.h>

#include <limits>

#include "world/state.h"

namespace pellicle::state_checks_test {
namespace {

TEST(NonFinite, TheFirstOfAnyRankIsNamedOnAll) {
  int rank = 0;
  int ranks = 1;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  const bool is_last = rank == ranks - 1;
  const Layout particles = number_owned(MPI_COMM_WORLD, 0);
  const std::vector<double> sound{1, -2, 0, std::numeric_limits<double>::max()};
  std::vector<double> broken = sound;
  broken[2] = is_last ? std::numeric_limits<double>::quiet_NaN() : 0;
  std::vector<double> infinite = sound;
  infinite[0] = rank == 0 ? -std::numeric_limits<double>::infinity() : 0;
  const auto words = [&](std::vector<double> position, std::vector<double> velocity) {
    FieldRegistry state(particles, 0);
    state.declare({"position", "m", Item::spring}, position);
    state.declare({"velocity", "m/s", Item::spring}, velocity);
    return non_finite(MPI_COMM_WORLD, state);
  };
  EXPECT_EQ(words(sound, sound), "");
  EXPECT_EQ(words(broken, infinite), "the position is not finite");
  EXPECT_EQ(words(sound, infinite), "the velocity is not finite");
  EXPECT_EQ(words({}, broken), "the velocity is not finite");
}

TEST(NonFinite, WhatIsNotFiniteBecomesZero) {
  int rank = 0;
  int ranks = 1;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  const Layout particles = number_owned(MPI_COMM_WORLD, 2);
  FieldRegistry state(particles, 1);
  auto& position = state.add<Field>({"position", "m", Item::particle}, 3);
  auto& ratio = state.add<std::vector<double>>({"ratio", "", Item::cell});
  auto& pressure = state.add<Eigen::VectorXd>({"pressure", "Pa", Item::object}, 2);
  auto& time = state.add<double>({"time", "s", Item::object});
  position.values().setConstant(3);
  ratio[0] = 4;
  EXPECT_FALSE(make_finite(MPI_COMM_WORLD, state));
  if (rank == ranks - 1) {
    position.values()(1, 1) = std::numeric_limits<double>::quiet_NaN();
    ratio[0] = std::numeric_limits<double>::infinity();
    pressure[1] = -std::numeric_limits<double>::infinity();
    time = std::numeric_limits<double>::quiet_NaN();
  }
  EXPECT_TRUE(make_finite(MPI_COMM_WORLD, state)) << "on every rank";
  const double expected = rank == ranks - 1 ? 0 : 3;
  EXPECT_EQ(position.values()(1, 1), expected);
  EXPECT_EQ(position.values()(0, 1), 3);
  EXPECT_EQ(ratio[0], rank == ranks - 1 ? 0 : 4);
  EXPECT_EQ(pressure[1], 0);
  EXPECT_EQ(time, 0);
}

}  // namespace
}  // namespace pellicle::state_checks_test
