#include "options/spelling.h"

#include <gtest/gtest.h>

namespace pellicle {

TEST(Spelling, EditDistanceCountsLetters) {
  EXPECT_EQ(edit_distance("", "abc"), 3);
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3);
  EXPECT_EQ(edit_distance("time.stepp", "time.step"), 1);
  EXPECT_EQ(edit_distance("tiem", "time"), 1);
  EXPECT_EQ(edit_distance("same", "same"), 0);
}

TEST(Spelling, NearestIsTheFirstOfTheClosest) {
  EXPECT_EQ(nearest("sprng", {"projection", "spring", "sprang"}), "spring");
  EXPECT_EQ(nearest("x", {}), "");
}

}  // namespace pellicle
