// Balloons that heat, char and burn through, by the whole program.

#include <cmath>
#include <map>

#include "tests/support/frames.h"
#include "tests/support/program.h"
#include "tests/support/run_checks.h"

namespace pellicle {
namespace {

/// A ball of few vertices whose side a hot ball burns through, solved to the end so that only rounding is left.
const std::string ball_deck = R"(
chain: inflate
mesh: {shape: icosphere, level: 2, radius: 0.1 m}
wall: {thickness: 0.3 mm, density: 1000, material: neo_hookean, mu: 0.4 MPa}
prism: {thickness: incompressible, mass_damping: 20, newton: converged, snes_rtol: 1e-9, ksp_rtol: 1e-10}
force: {gravity: [0, 0, 0]}
chambers:
  gas: {law: isothermal, amount_ratio: [[0, 1.05]]}
heat:
  diffusivity: 1e-3
  convection: 20
  ksp_rtol: 1e-12
  sources:
    flame: {shape: ball, radius: 0.1 m, temperature: 2000 K, rate: 60,
            path: [[0, 0.2, 0.01, 0.02], [0.1, 0.13, 0.01, 0.02]]}
combustion: {ignition_temperature: 600, mass_loss_rate: 0.03, min_mass: 0.2, char_stiffness: 0.25}
ablation: {loss_mass: 0.4}
time: {step: 5 ms, end: 1 s}
output: {name: ball, interval_steps: 10}
)";

/// A strip of triangles, constrained at its ends, which a hot ball that comes across cuts in two.
const std::string strip_deck = R"(
chain: inflate
mesh: {shape: rectangle, cells: [16, 4], size: [0.4 m, 0.1 m]}
wall: {thickness: 0.3 mm, density: 1000, material: neo_hookean, mu: 0.4 MPa}
prism: {thickness: incompressible, mass_damping: 20}
force: {gravity: [0, 0, 0]}
pins:
  left: {box: [-0.21, -1, -1, -0.199, 1, 1]}
  right: {box: [0.199, -1, -1, 0.21, 1, 1], path: [[0, 0, 0, 0], [0.05, 0.02, 0, 0]]}
heat:
  diffusivity: 1e-3
  convection: 20
  sources:
    flame: {shape: ball, radius: 0.08 m, temperature: 2000 K, rate: 60,
            path: [[0.05, 0.03, -0.2, 0], [0.3, 0.03, 0.2, 0]]}
combustion: {ignition_temperature: 600, mass_loss_rate: 0.1, min_mass: 0.2, char_stiffness: 0.5}
ablation: {loss_mass: 0.4}
time: {step: 5 ms, end: 0.4 s}
output: {name: strip, interval_steps: 20}
)";

class BurningBalloonsTest : public ProgramTest {
 protected:
  /// Runs a deck. @returns what it printed
  std::string run(int ranks, const Arguments& arguments) {
    out_ = folder() / ("out" + std::to_string(++runs_));
    return succeed(ranks, arguments + Arguments{"-output_directory", out_.string()}).output;
  }
  std::map<std::string, std::vector<double>> history() const { return history_of(out_); }

  /// content = initial + in - out, to a billionth of what came in.
  static void expect_closed_ledger(const std::map<std::string, std::vector<double>>& history) {
    for (std::size_t row = 0; row < history.at("time").size(); ++row) {
      const auto value = [&](const char* name) { return history.at(name)[row]; };
      const double open = value("heat_content") - history.at("heat_content").front() - value("heat_in") +
                          value("heat_out") - value("heat_made");
      EXPECT_LE(std::abs(open), 1e-9 * value("heat_in") + 1e-12 * value("heat_content")) << "row " << row;
      EXPECT_NEAR(value("mass_left") + value("mass_burnt"), history.at("mass_left").front(),
                  1e-12 * history.at("mass_left").front());
    }
  }

  CommandResult refuse(const Arguments& arguments) const {
    CommandResult result = pellicle(1, arguments);
    EXPECT_NE(result.exit_code, 0) << result;
    return result;
  }

  std::filesystem::path out_;  ///< of the last run

 private:
  int runs_ = 0;
};

/// "chamber gas is open: element 12 at (...) m has burnt through" of what a run printed.
std::string end_of(const std::string& printed) {
  std::smatch found;
  const std::regex line("ended at .*: (chamber gas is open: element [0-9]+ at \\(.*\\) m has burnt through)\n");
  return std::regex_search(printed, found, line) ? found[1].str() : "no such end in: " + printed;
}

TEST_F(BurningBalloonsTest, TheRunEndsWithTheHoleOnAnyRanks) {
  const std::string deck = write("ball.yaml", ball_deck);
  const std::string end = end_of(run(1, {deck}));
  EXPECT_EQ(end.find("chamber gas is open"), 0U) << end;
  const auto one = history();
  expect_closed_ledger(one);
  EXPECT_LT(one.at("time").back(), 0.9) << "before its time";
  EXPECT_GT(one.at("temperature_max").back(), 600);
  EXPECT_LT(one.at("mass_left").back(), 0.999 * one.at("mass_left").front());
  const auto steps = static_cast<int>(one.at("step").back());
  expect_whole_output(out_, "ball", steps);
  const DrawnFrame frame = last_frame(out_ / "ball.pvd");
  for (const char* field : {"temperature", "mass_ratio", "velocity"}) {
    EXPECT_EQ(frame.point_fields.count(field), 1U) << field;
  }
  for (const char* field : {"burn_time", "piece", "thickness", "stress"}) {
    EXPECT_EQ(frame.cell_fields.count(field), 1U) << field;
  }
  for (const int ranks : {2, 3, 4}) {
    EXPECT_EQ(end_of(run(ranks, {deck})), end) << ranks;
    const auto several = history();
    EXPECT_EQ(several.at("step"), one.at("step"));
    for (const char* name : {"mass_left", "heat_content", "temperature_max", "gas_pressure", "elastic_energy"}) {
      EXPECT_NEAR(several.at(name).back(), one.at(name).back(), 1e-6 * std::abs(one.at(name).back())) << name;
    }
    expect_closed_ledger(several);
    expect_same_remains(frame, last_frame(out_ / "ball.pvd"), 1e-6, std::to_string(ranks) + " ranks");
  }
}

TEST_F(BurningBalloonsTest, AWallWithoutAChamberIsCutInTwo) {
  const std::string deck = write("strip.yaml", strip_deck);
  const std::string printed = run(1, {deck});
  EXPECT_EQ(printed.find("ended at"), std::string::npos) << printed;
  const auto one = history();
  EXPECT_NEAR(one.at("time").back(), 0.4, 1e-9);
  EXPECT_EQ(one.at("pieces").front(), 1);
  EXPECT_EQ(one.at("pieces").back(), 2);
  expect_closed_ledger(one);
  expect_whole_output(out_, "strip", 80);
  const auto pieces = read_csv(out_ / "pieces.csv");
  EXPECT_EQ(pieces.at("piece").back(), 1);
  EXPECT_GT(pieces.at("birth_time").back(), 0.1);
  for (const int ranks : {2, 3}) {
    run(ranks, {deck});
    EXPECT_EQ(history().at("pieces"), one.at("pieces")) << ranks;
    EXPECT_NEAR(history().at("mass_burnt").back(), one.at("mass_burnt").back(), 1e-6 * one.at("mass_burnt").back());
    expect_closed_ledger(history());
  }
}

TEST_F(BurningBalloonsTest, AWallOfFourTrianglesBurnsAwayAlsoOnRanksWithoutAny) {
  write("tetrahedron.obj", "v 1 1 1\nv 1 -1 -1\nv -1 1.5 -1\nv -2 -1 1\nf 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n");
  const std::string deck = write("few.yaml", R"(
chain: inflate
mesh: {file: tetrahedron.obj}
wall: {thickness: 10 mm, material: neo_hookean, mu: 0.4 MPa}
force: {gravity: [0, 0, 0]}
chambers: {gas: {law: pressure, pressure: [[0, 10]]}}
heat: {initial_temperature: 900, diffusivity: 1e-3}
combustion: {ignition_temperature: 600, mass_loss_rate: 0.05}
ablation: {loss_mass: 0.5}
time: {step: 10 ms, end: 1 s}
output: {name: few, interval_steps: 10}
)");
  for (const int ranks : {1, 3, 4}) {
    const std::string printed = run(ranks, {deck});
    EXPECT_NE(printed.find("the wall has burnt away"), std::string::npos) << printed;
    EXPECT_NEAR(history().at("mass_left").back(), 0, 1e-15);
    EXPECT_EQ(history().at("pieces").back(), 0);
    expect_closed_ledger(history());
  }
}

TEST_F(BurningBalloonsTest, AStepFromACheckpointIsTheSameToTheLastBit) {
  const std::string deck = write("ball.yaml", ball_deck);
  for (const int ranks : {1, 2}) {
    const std::string printed = run(ranks, {deck, "-verify_restart", "10"});
    EXPECT_NE(printed.find("fields are the same"), std::string::npos) << printed;
  }
  const auto table = history();
  EXPECT_GT(table.at("mass_burnt").back(), table.at("mass_burnt")[10]) << "it burns meanwhile";
}

// The tension of a sphere is p r / 2: it cracks where that exceeds the strength, a cold one as well.
TEST_F(BurningBalloonsTest, ABalloonBurstsWhereItsTensionExceedsItsStrength) {
  const std::string deck = write("burst.yaml", R"(
chain: inflate
mesh: {shape: icosphere, level: 3, radius: 0.1 m}
wall: {thickness: 0.3 mm, material: neo_hookean, mu: 0.4 MPa}
prism: {newton: converged, inertia: false, mass_damping: 1}
force: {gravity: [0, 0, 0]}
chambers: {gas: {law: volume, volume_ratio: [[0, 1], [1, 3]]}}
ablation: {strength: 100 N/m, strength_scatter: 0.02, seed: 3}
time: {step: 10 ms, end: 1 s}
output: {name: burst, interval_steps: 100}
)");
  std::string end;
  for (const int ranks : {1, 2, 3}) {
    const std::string printed = run(ranks, {deck});
    const std::size_t begin = printed.find("chamber gas is open: it has torn at vertex ");
    ASSERT_NE(begin, std::string::npos) << printed;
    const std::string text = printed.substr(begin, printed.find('\n', begin) - begin);
    EXPECT_TRUE(end.empty() || end == text) << text;
    end = text;
    const auto table = history();
    const auto tension = [&](std::size_t row) {
      return table.at("gas_pressure")[row] * std::cbrt(3 * table.at("gas_volume")[row] / (4 * M_PI)) / 2;
    };
    const std::size_t last = table.at("time").size() - 1;
    EXPECT_NEAR(tension(last), 100, 0.05 * 100) << "but for the scatter and the triangles";
    EXPECT_GE(table.at("cracked_sides").back(), 2);
    EXPECT_NEAR(table.at("mass_left").back(), table.at("mass_left").front(), 1e-15) << "nothing is lost";
    EXPECT_EQ(table.at("mass_burnt").back(), 0) << "what tears does not burn";
    expect_closed_ledger(table);
  }
}

TEST_F(BurningBalloonsTest, WithoutHeatThereIsNothingOfIt) {
  const std::string deck = write("cold.yaml", R"(
chain: inflate
mesh: {shape: icosphere, level: 1, radius: 0.1 m}
chambers: {gas: {law: relative, pressure: [[0, 0], [0.1, 100]]}}
time: {step: 10 ms, end: 0.02 s}
output: {name: cold}
)");
  run(1, {deck});
  EXPECT_EQ(history().count("heat_content"), 0U);
  EXPECT_EQ(read_csv(out_ / "history.csv").count("seconds_heat"), 0U);
  EXPECT_FALSE(std::filesystem::exists(out_ / "pieces.csv"));
  EXPECT_EQ(last_frame(out_ / "cold.pvd").point_fields.count("temperature"), 0U);
  // What would have no effect is refused, with what it needs.
  for (const Arguments& idle : {Arguments{"-heat_diffusivity", "1e-3"},
                                {"-combustion_char_stiffness", "0.5"},
                                {"-ablation_loss_mass", "0.5"},
                                {"-heat_initial_temperature", "320"}}) {
    const CommandResult result = refuse(Arguments{deck} + idle);
    EXPECT_NE(result.errors.find("heat.sources"), std::string::npos) << result;
  }
}

TEST_F(BurningBalloonsTest, WhatDoesNotActOnABalloonIsRefused) {
  const std::string deck = write("ball.yaml", ball_deck);
  const std::map<std::string, Arguments> bad{
      {"chain: burn", {"-combustion_lattice_factor", "2"}},
      {"combustion_corner_factor", {"-combustion_corner_factor", "2"}},
      {"ablation_compact_fraction", {"-ablation_compact_fraction", "0.5"}},
      {"prism.thickness: global, the volume of the whole wall", {"-prism_thickness", "global"}}};
  for (const auto& [words, arguments] : bad) {
    const CommandResult result = refuse(Arguments{deck} + arguments);
    EXPECT_NE(result.errors.find(words), std::string::npos) << result;
  }
  const CommandResult result = refuse({deck_path("uniform_shrink_spring"), "-combustion_char_stiffness", "0.5"});
  EXPECT_NE(result.errors.find("chain: inflate"), std::string::npos) << result;
}

}  // namespace
}  // namespace pellicle
