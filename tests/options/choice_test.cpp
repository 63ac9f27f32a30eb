#include "options/choice.h"

#include <gtest/gtest.h>

#include "base/error.h"
#include "options/options.h"

namespace pellicle {
namespace {

enum class Shade { clear, grey, opaque };
const std::vector<std::string>& names_of(Shade) {
  static const std::vector<std::string> names{"clear", "half", "opaque"};
  return names;
}

TEST(Choice, HasAValueAndItsName) {
  Choice<Shade> shade = Shade::grey;
  EXPECT_EQ(shade, Shade::grey);
  EXPECT_EQ(shade.name(), "half");
  shade = Shade::opaque;
  EXPECT_EQ(shade.name(), "opaque");
  shade = "clear";
  EXPECT_EQ(shade, Shade::clear);
  const Choice<Shade> copy = shade;
  shade = Shade::grey;
  EXPECT_EQ(copy, Shade::clear);
  EXPECT_THROW(shade = "grey", Error);
}

TEST(Choice, IsAnOptionOfTheTable) {
  Choice<Shade> shade = Shade::grey;
  OptionTable table;
  Option& option = table.add("lamp.shade", shade);
  EXPECT_EQ(option.default_text(), "half");
  EXPECT_EQ(option.range_text(), "clear, half, opaque");
  EXPECT_EQ(option.expected(), "one of clear, half, opaque");
  const Condition lets_light_through = one_of("lamp.shade", shade, {Shade::clear, Shade::grey});
  EXPECT_EQ(lets_light_through.words, "lamp.shade: clear, half");
  EXPECT_TRUE(lets_light_through.holds());
  option.assign(option.from_command_line("opaque"));
  EXPECT_EQ(shade, Shade::opaque);
  EXPECT_EQ(option.value().rows.front().front(), "opaque");
  EXPECT_FALSE(lets_light_through.holds());
  try {
    option.assign(option.from_command_line("opak"));
    ADD_FAILURE() << "taken";
  } catch (const Error& error) {
    EXPECT_EQ(std::string(error.what()),
              "\"opak\" is not a choice, the nearest is opaque; expected one of clear, half, opaque");
  }
  EXPECT_EQ(shade, Shade::opaque);
}

}  // namespace
}  // namespace pellicle
