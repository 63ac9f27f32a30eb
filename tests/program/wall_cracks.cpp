// Walls that crack, by the whole program.

#include <algorithm>
#include <cmath>
#include <map>

#include "tests/support/frames.h"
#include "tests/support/program.h"
#include "tests/support/run_checks.h"

namespace pellicle::wall_cracks_test {
namespace {

class WallCracksTest : public ProgramTest {
 protected:
  /// Runs a deck. @returns what it printed
  std::string run(int ranks, const Arguments& arguments) {
    out_ = folder() / ("out" + std::to_string(++runs_));
    return succeed(ranks, arguments + Arguments{"-output_directory", out_.string()}).output;
  }
  std::map<std::string, std::vector<double>> history() const { return history_of(out_); }

  std::filesystem::path out_;  ///< of the last run

 private:
  int runs_ = 0;
};

/// A strip of rubber that is drawn out until it cracks here and there and comes apart.
const std::string torn_deck = R"(
chain: inflate
mesh: {shape: rectangle, cells: [12, 6], size: [0.2 m, 0.1 m]}
wall: {thickness: 1 mm, density: 1000, material: neo_hookean, mu: 0.4 MPa}
prism: {mass_damping: 100, stiffness_damping: 5 ms, newton: converged, snes_rtol: 1e-10, ksp_rtol: 1e-10}
force: {gravity: [0, 0, 0]}
pins:
  left: {box: [-0.11, -1, -1, -0.0999, 1, 1]}
  right: {box: [0.0999, -1, -1, 0.11, 1, 1], velocity: [0.4, 0, 0]}
ablation: {strength: 200 N/m, strength_scatter: 0.3}
time: {step: 2 ms, end: 0.12 s}
output: {name: torn, interval_steps: 20}
)";

TEST_F(WallCracksTest, AWallIsPartedByTheSameCracksOnAnyRanks) {
  const std::string deck = write("torn.yaml", torn_deck);
  run(1, {deck});
  const auto one = history();
  const DrawnFrame whole = last_frame(out_ / "torn.pvd");
  EXPECT_GT(one.at("cracked_sides").back(), 6) << "across, and elsewhere";
  EXPECT_GE(one.at("pieces").back(), 2);
  EXPECT_NEAR(one.at("mass_left").back(), one.at("mass_left").front(), 1e-14);
  EXPECT_EQ(one.at("mass_burnt").back(), 0);
  EXPECT_EQ(whole.cells, 2 * 12 * 6) << "no element is lost";
  EXPECT_GE(whole.points.at("vertex_id").size(), 13 * 7U + 7);
  for (const int ranks : {2, 3, 4}) {
    run(ranks, {deck});
    const auto several = history();
    for (const char* column : {"cracked_sides", "crack_length", "pieces"}) {
      ASSERT_EQ(one.at(column).size(), several.at(column).size());
      for (std::size_t row = 0; row < one.at(column).size(); ++row) {
        EXPECT_NEAR(one.at(column)[row], several.at(column)[row], 1e-12) << column << ", " << ranks << " ranks";
      }
    }
    expect_same_balloon(whole, last_frame(out_ / "torn.pvd"), agreement, std::to_string(ranks) + " ranks");
  }
}

TEST_F(WallCracksTest, ACrackedWallGoesOnFromACheckpoint) {
  const std::string deck = write("torn.yaml", torn_deck);
  run(1, {deck});
  const auto straight = history();
  const auto& sides = straight.at("cracked_sides");
  const auto first = std::find_if(sides.begin(), sides.end(), [](double count) { return count > 0; });
  const auto steps = static_cast<int>(first - sides.begin()) + 2;  // in the middle of it
  EXPECT_GT(sides.back(), sides[steps]);
  for (const int ranks : {1, 2}) {
    const std::string printed = run(ranks, {deck, "-verify_restart", std::to_string(steps)});
    EXPECT_NE(printed.find("fields are the same"), std::string::npos) << printed;
    EXPECT_GT(history().at("cracked_sides").back(), sides[steps]) << "it cracks meanwhile";
  }
  run(2, {deck, "-time_max_steps", std::to_string(steps)});
  const std::string begun = out_.string();
  run(3, {"-restart", begun, "-time_max_steps", std::to_string(sides.size() - 1)});
  for (const char* column : {"cracked_sides", "pieces"}) {
    EXPECT_EQ(history().at(column).back(), straight.at(column).back()) << column;
  }
}

// Gas whose pressure is given goes on pushing what cracks leave of its wall.
TEST_F(WallCracksTest, ABallUnderAGivenPressureCracksOnAndOn) {
  const std::string deck = write("shell.yaml", R"(
chain: inflate
mesh: {shape: icosphere, level: 2, radius: 0.1 m}
wall: {thickness: 1 mm, material: neo_hookean, mu: 0.4 MPa}
prism: {mass_damping: 200, stiffness_damping: 5 ms}
force: {gravity: [0, 0, 0]}
chambers: {gas: {law: pressure, pressure: [[0, 0], [0.1, 4 kPa]]}}
ablation: {strength: 150 N/m, strength_scatter: 0.1}
time: {step: 2 ms, end: 0.1 s}
output: {name: shell, interval_steps: 20}
)");
  const std::string printed = run(2, {deck, "-time_max_steps", "41", "-checkpoint_interval_steps", "38"});
  const auto table = history();
  EXPECT_GT(table.at("cracked_sides").back(), 20) << printed;
  EXPECT_EQ(last_frame(out_ / "shell.pvd").cells, 320);
  EXPECT_NEAR(table.at("mass_left").back(), table.at("mass_left").front(), 1e-14);
  const auto& sides = table.at("cracked_sides");
  const auto before = static_cast<std::size_t>(
      std::find_if(sides.begin(), sides.end(), [](double count) { return count > 0; }) - sides.begin() - 1);
  const double radius = std::cbrt(3 * table.at("gas_volume")[before] / (4 * M_PI));
  EXPECT_NEAR(table.at("gas_pressure")[before] * radius / 2, 150, 0.15 * 150) << "p R / 2";

  const std::string checkpoint = (out_ / "checkpoint_000038.h5").string();
  run(2, {"-restart", checkpoint, "-time_max_steps", "41"});
  for (const char* column : {"cracked_sides", "gas_volume", "kinetic_energy"}) {
    EXPECT_EQ(history().at(column).back(), table.at(column).back()) << column;
  }
  EXPECT_GT(sides.back(), sides[38]) << "it cracks meanwhile";
}

/// A balloon that is pumped up until it bursts, at 12 ms; 2 ms later its wall is in pieces.
const std::string burst_deck = R"(
chain: inflate
mesh: {shape: icosphere, level: 3, radius: 0.1 m}
wall: {thickness: 0.3 mm, density: 1000, material: mooney_rivlin, c1: 0.18 MPa, c2: 0.02 MPa}
prism: {newton: fixed, snes_max_it: 6, mass_damping: 20}
force: {gravity: [0, 0, 0]}
chambers: {air: {law: adiabatic, hole_discharge: 0.6}}
gas_network: {links: {pump: {to: air, flow: [[0 s, 20], [1 s, 20]]}}}
ablation: {strength: 150 N/m, strength_scatter: 0.3}
time: {step: 0.5 ms, end: 16 ms}
output: {name: burst}
)";

TEST_F(WallCracksTest, ABalloonThatBurstsIsTheSameOnAnyRanksUntilItCracks) {
  const std::string deck = write("burst.yaml", burst_deck);
  std::map<std::string, std::vector<double>> one;
  for (const int ranks : {1, 2, 3}) {
    run(ranks, {deck});
    const auto found = history();
    one = ranks == 1 ? found : one;
    const std::vector<double>& sides = found.at("cracked_sides");
    const auto first = static_cast<std::size_t>(
        std::find_if(sides.begin(), sides.end(), [](double count) { return count > 0; }) - sides.begin());
    ASSERT_LT(first, sides.size());
    for (const char* column : {"gas_pressure", "gas_amount", "gas_temperature", "cracked_sides", "elastic_energy"}) {
      for (std::size_t row = 1; row <= first; ++row) {
        EXPECT_NEAR(found.at(column)[row], one.at(column)[row], 1e-4 * std::abs(one.at(column)[row]))
            << column << " on " << ranks << " ranks, row " << row;
      }
    }
    EXPECT_GT(found.at("gas_pressure")[first], 1500);
    EXPECT_EQ(found.at("gas_pressure").back(), 0) << "open for good";
    EXPECT_GT(found.at("pieces").back(), 3);
    EXPECT_GT(found.at("gas_leak").back(), 0.1);
    EXPECT_NEAR(sides.back(), one.at("cracked_sides").back(), 0.1 * sides.back()) << "and in its statistics then";
  }
}

TEST_F(WallCracksTest, ACheckpointInTheMiddleOfABurstLeadsToTheSame) {
  const std::string deck = write("burst.yaml", burst_deck);
  for (const int ranks : {1, 2}) {
    const std::string printed = run(ranks, {deck, "-verify_restart", "26"});
    EXPECT_NE(printed.find("fields are the same"), std::string::npos) << printed;
  }
}

}  // namespace
}  // namespace pellicle::wall_cracks_test
