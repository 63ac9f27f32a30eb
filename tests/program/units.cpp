// No number in the program stands for a length, a mass or a time: a world 4096 times as large, in which everything
// takes 4096 times as long, behaves alike.

#include "base/units.h"

#include <cmath>
#include <numeric>

#include "tests/support/csv.h"
#include "tests/support/program.h"

namespace pellicle {
namespace {

/// Powers of two, so that rounding is the same. Masses grow as times cubed, which leaves the constant of Stefan and
/// Boltzmann as it is, and amounts of gas as energies, which leaves the gas constant. Of metre, kilogram, second,
/// kelvin, mole and radian.
constexpr Dimension doublings{12, 36, 12, 0, 36, 0};

int doublings_of(const std::string& unit) {
  const Dimension dimension = parse_unit(unit).dimension;
  return std::inner_product(dimension.begin(), dimension.end(), doublings.begin(), 0);
}

/// A line of options.yaml, "step: 0.01  # s" or "path: [[0, 0.1], [1, 0.3]]  # s,m", in the larger world. What is said
/// of the clock on the wall stays.
std::string enlarged(const std::string& line) {
  std::smatch parts;
  if (!std::regex_match(line, parts, std::regex("( *[a-z_0-9]+: )(.*)  # (.*)")) ||
      parts[1].str().find("interval_wall") != std::string::npos) {
    return line;
  }
  std::vector<std::string> units;
  std::istringstream list(parts[3]);
  for (std::string unit; std::getline(list, unit, ',');) {
    units.push_back(unit);
  }
  const std::string values = parts[2];
  const std::regex number(R"([-+]?[0-9][-+.e0-9]*)");
  std::string text = parts[1];
  std::size_t end = 0;
  std::size_t k = 0;
  for (std::sregex_iterator it(values.begin(), values.end(), number); it != std::sregex_iterator(); ++it, ++k) {
    const auto begin = static_cast<std::size_t>(it->position());
    text += values.substr(end, begin - end);
    text += number_text(std::ldexp(std::stod(it->str()), doublings_of(units[k % units.size()])));
    end = begin + static_cast<std::size_t>(it->length());
  }
  return text + values.substr(end);
}

struct Scene {
  std::string deck;
  Arguments options;
};

class UnitsTest : public ProgramTest, public testing::WithParamInterface<Scene> {};

TEST_P(UnitsTest, AWorldOfAnotherSizeBehavesAlike) {
  const auto& [deck, options] = GetParam();
  succeed(1, Arguments{deck_path(deck)} + options + Arguments{"-time_max_steps", "3", "-output_directory", "out"});
  std::istringstream given(text_of(folder() / "out" / "options.yaml"));
  std::string larger;
  int changed = 0;
  for (std::string line; std::getline(given, line);) {
    if (line.find("  directory: ") == 0) {
      continue;
    }
    const std::string other = enlarged(line);
    changed += other == line ? 0 : 1;
    larger += other + "\n";
  }
  EXPECT_GT(changed, 8);
  succeed(1, {write("larger.yaml", larger), "-output_directory", "larger"});

  const auto before = read_csv(folder() / "out" / "history.csv");
  const auto after = read_csv(folder() / "larger" / "history.csv");
  const std::string text = text_of(folder() / "out" / "history.csv");
  std::istringstream head(text.substr(0, text.find('\n')));
  ASSERT_EQ(before.at("step").back(), 3);
  for (std::string title; std::getline(head, title, ',');) {
    std::smatch parts;
    ASSERT_TRUE(std::regex_match(title, parts, std::regex(R"(([a-z_0-9]+)( \[(.*)\])?)"))) << title;
    const std::string name = parts[1];
    if (name.find("seconds_") == 0) {
      continue;
    }
    const int power = parts[3].matched ? doublings_of(parts[3]) : 0;
    ASSERT_EQ(before.at(name).size(), after.at(name).size()) << name;
    for (std::size_t row = 0; row < before.at(name).size(); ++row) {
      EXPECT_DOUBLE_EQ(std::ldexp(before.at(name)[row], power), after.at(name)[row]) << name << " in row " << row;
    }
  }
}

// Of hot_ball the tensile stiffness is given, since its default is a number in SI. None of the scenes reads its mesh
// from a file, which would keep its size.
INSTANTIATE_TEST_SUITE_P(
    Of, UnitsTest,
    testing::Values(Scene{"hot_ball",
                          {"-mesh_cells", "16,16", "-sheet_tensile_stiffness", "300", "-heat_emissivity", "0.8"}},
                    Scene{"cloth_over_sphere", {"-mesh_cells", "20,20"}}, Scene{"flag", {"-mesh_cells", "16,10"}},
                    Scene{"burning_balloon", {"-mesh_level", "2"}}, Scene{"pinched_balloon", {"-mesh_level", "2"}}),
    [](const auto& scene) { return scene.param.deck; });

}  // namespace
}  // namespace pellicle
