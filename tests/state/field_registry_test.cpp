#include "state/field_registry.h"

#include <gtest/gtest.h>
#include <petscsys.h>

#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "parallel/collective.h"

namespace pellicle::field_registry_test {
namespace {

/// A registry with one field on two cells of each rank, two numbers a cell, and one that does not differ.
struct Kept {
  explicit Kept(std::vector<double> numbers) {
    registry.add<std::vector<double>>({"heat", "J", Item::cell}, 2) = std::move(numbers);
    registry.add<double>({"time", "s", Item::object}) = 3;
  }
  Layout none;
  FieldRegistry registry{none, 2};
};

// The numbers of the last rank differ by 3, the largest of all is on the first.
TEST(FieldRegistryDifferences, AreThoseOfAllRanksOverTheLargestNumberOfAll) {
  const int rank = rank_of(PETSC_COMM_WORLD);
  const bool is_last = rank + 1 == ranks_of(PETSC_COMM_WORLD);
  const std::vector<double> numbers{1, rank == 0 ? -10.0 : 2.0, 4, 5};
  std::vector<double> others = numbers;
  others[2] += is_last ? -3 : 0;
  using Named = std::vector<std::pair<std::string, double>>;
  EXPECT_EQ(differences(PETSC_COMM_WORLD, Kept(numbers).registry, Kept(others).registry),
            (Named{{"heat", 0.3}, {"time", 0}}));
  EXPECT_EQ(differences(PETSC_COMM_WORLD, Kept(numbers).registry, Kept(numbers).registry),
            (Named{{"heat", 0}, {"time", 0}}));
}

TEST(FieldRegistryDifferences, AreInfiniteIfOneOfTwoIsNoNumberOrInfinite) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  const auto difference = [](double one, double other) {
    return differences(PETSC_COMM_WORLD, Kept({1, one, 2, 3}).registry, Kept({1, other, 2, 3}).registry)[0].second;
  };
  EXPECT_EQ(difference(5, none), infinity);
  EXPECT_EQ(difference(none, 5), infinity);
  EXPECT_EQ(difference(infinity, 5), infinity);
  EXPECT_EQ(difference(infinity, none), infinity);
  EXPECT_EQ(difference(none, none), 0);
  EXPECT_EQ(difference(infinity, infinity), 0);
}

}  // namespace
}  // namespace pellicle::field_registry_test
