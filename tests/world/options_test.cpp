#include "world/options.h"

#include <gtest/gtest.h>

#include <sstream>

#include "base/error.h"
#include "options/options.h"
#include "tests/support/solver_options.h"

namespace pellicle::options_test {
namespace {

/// All values of a table by key.
std::map<std::string, std::vector<std::vector<std::string>>> values_of(const OptionTable& table) {
  std::map<std::string, std::vector<std::vector<std::string>>> values;
  for (const Option& option : table.options()) {
    values[option.key()] = option.value().rows;
  }
  return values;
}

/// Gives an option another value, of its kind and within its range. @returns whether one was found
bool change(Option& option) {
  const WrittenValue before = option.value();
  std::vector<std::string> words{"0.37", "0.5", "2", "3", "true", "false", "word", "YBGR"};  // an order of colours
  std::istringstream choices(option.range_text());
  for (std::string word; choices >> word;) {
    words.push_back(word.substr(0, word.find(',')));
  }
  using Kind = WrittenValue::Kind;
  for (const std::string& word : words) {
    for (const std::size_t length : {1U, 2U, 3U, 4U, 6U}) {
      for (const Kind kind : {Kind::scalar, Kind::list, Kind::rows}) {
        try {
          option.assign({kind, {std::vector<std::string>(length, word)}});
        } catch (const Error&) {
          continue;
        }
        if (option.value().rows != before.rows) {
          return true;
        }
      }
    }
  }
  return false;
}

TEST(Options, EachSetsItselfAndNothingElse) {
  if (ranks() > 1) {
    GTEST_SKIP() << "on one rank only";
  }
  OptionTable table;
  Options options;
  describe(table, options);
  for (const OptionTable::ObjectSection& section : table.object_sections()) {
    table.create_object(section.key, "one");
    table.create_object(section.key, "other");
  }
  for (Option& option : table.options()) {
    auto expected = values_of(table);
    EXPECT_TRUE(change(option)) << option.key();
    expected[option.key()] = option.value().rows;
    EXPECT_EQ(values_of(table), expected) << option.key();
  }
}

TEST(Options, OfTexturesSetWhatTheChainsRead) {
  OptionTable table;
  Options options;
  describe(table, options);
  table.create_object("heat.sources", "iron");
  const std::vector<std::pair<std::string, std::string*>> files{
      {"combustion.mass_loss_texture", &options.combustion.mass_loss_texture},
      {"heat.diffusivity_texture", &options.heat.diffusivity_texture},
      {"heat.sources.iron.file", &options.heat.sources.at("iron").file},
      {"project.weight_texture", &options.project.weight_texture},
      {"ablation.strength_texture", &options.ablation.strength_texture},
      {"wall.thickness_texture", &options.wall.thickness_texture}};
  for (const auto& [key, file] : files) {
    Option* option = table.find_key(key);
    ASSERT_NE(option, nullptr) << key;
    option->assign({WrittenValue::Kind::scalar, {{key + ".png"}}});
    EXPECT_EQ(*file, key + ".png");
  }
  const std::vector<std::pair<std::string, std::vector<double>*>> ranges{
      {"combustion.mass_loss_range", &options.combustion.mass_loss_range},
      {"heat.diffusivity_range", &options.heat.diffusivity_range},
      {"ablation.strength_range", &options.ablation.strength_range},
      {"wall.thickness_range", &options.wall.thickness_range}};
  double black = 1;
  for (const auto& [key, range] : ranges) {
    Option* option = table.find_key(key);
    ASSERT_NE(option, nullptr) << key;
    option->assign({WrittenValue::Kind::list, {{std::to_string(++black), std::to_string(black / 2)}}});
    EXPECT_EQ(*range, (std::vector<double>{black, black / 2})) << key << ": black, then white";
  }
}

}  // namespace
}  // namespace pellicle::options_test
