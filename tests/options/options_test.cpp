#include "options/options.h"

#include <gtest/gtest.h>

#include "base/error.h"

namespace pellicle {
namespace {

/// What an option says to a word of the command line; empty: it takes it.
std::string answer(Option& option, const std::string& text) {
  try {
    option.assign(option.from_command_line(text));
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Option, BoundsAreInsideOrOutsideOfTheRange) {
  double fraction = 0.25;
  OptionTable table;
  Option& option = table.add("solver.rtol", fraction);
  option.more_than(0).at_most(0.5);
  EXPECT_EQ(option.range_text(), "more than 0, at most 0.5");
  EXPECT_EQ(answer(option, "0"), "\"0\" is out of range; expected a pure number, more than 0, at most 0.5");
  EXPECT_EQ(answer(option, "0.51"), "\"0.51\" is out of range; expected a pure number, more than 0, at most 0.5");
  EXPECT_EQ(answer(option, "0.5"), "");
  EXPECT_EQ(fraction, 0.5);
  Option& open = table.add("wall.ratio", fraction);
  open.more_than(-1).less_than(0.5);
  EXPECT_EQ(open.range_text(), "more than -1, less than 0.5");
  EXPECT_NE(answer(open, "0.5"), "");
  EXPECT_NE(answer(open, "-1"), "");
  EXPECT_EQ(answer(open, "-0.99"), "");
}

TEST(Option, TheRangeOfKeyPointsIsThatOfTheirValues) {
  Rows rows;
  OptionTable table;
  Option& option = table.add("valve.opens", rows);
  option.unit("s,1").range(0, 1);
  EXPECT_EQ(option.range_text(), "2 numbers a row; behind the time 0 to 1");
  EXPECT_EQ(answer(option, "-5,0;7,1"), "") << "a time may be any";
  EXPECT_EQ(rows, (Rows{{-5, 0}, {7, 1}}));
  EXPECT_EQ(answer(option, "0,0;1,-1"),
            "\"-1\" is out of range; expected a list of rows of 2, numbers in s,1, behind the time 0 to 1");
}

}  // namespace
}  // namespace pellicle
