// Gas in closed sheets, by the whole program: it is stiff, prescribed or warm, and ends the run where it would escape.

#include <cmath>
#include <map>
#include <regex>

#include "tests/support/frames.h"
#include "tests/support/program.h"
#include "tests/support/run_checks.h"

namespace pellicle::sheet_gas_test {
namespace {

/// A closed lantern of 96 quads, small enough that air in it is stiff: steps of 20 ms.
const std::string lantern = R"(
mesh: {shape: quad_ellipsoid, level: 2, semi_axes: [0.1 m, 0.1 m, 0.12 m]}
sheet: {thickness: 6 mm, areal_density: 0.1, perturbation: 0.01}
force: {gravity: [0, 0, 0]}
heat: {ksp_rtol: 1e-12}
dynamics: projection
project: {ksp_rtol: 1e-10}
time: {step: 20 ms, end: 0.8 s}
output: {name: lantern, interval_time: 0.2 s}
)";

const std::string fire = R"(
chambers: {air: {law: isothermal, amount_ratio: [[0, 1.01]]}}
heat:
  diffusivity: 1e-3
  sources:
    flame: {radius: 0.08 m, temperature: 2000 K, rate: 60, path: [[0, 0.2, 0.01, 0.02], [0.1, 0.13, 0.01, 0.02]]}
combustion: {ignition_temperature: 600, mass_loss_rate: 0.03, min_mass: 0.2}
ablation: {loss_mass: 0.4}
)";

class SheetGasTest : public ProgramTest {
 protected:
  /// Runs the lantern with what a deck adds. @returns what it printed
  std::string run(int ranks, const std::string& more, const Arguments& arguments = {}) {
    out_ = folder() / ("out" + std::to_string(++runs_));
    return succeed(ranks, Arguments{write("lantern.yaml", lantern), write("more.yaml", more), "-output_directory",
                                    out_.string()} +
                              arguments)
        .output;
  }
  std::map<std::string, std::vector<double>> history() const { return history_of(out_); }

  std::filesystem::path out_;  ///< of the last run

 private:
  int runs_ = 0;
};

TEST_F(SheetGasTest, StiffAirComesToRestAtItsLawOnAnyRanks) {
  const std::string air = "chambers: {air: {law: isothermal, amount_ratio: [[0, 0.9], [0.3, 1.05]]}}\n";
  std::map<std::string, std::vector<double>> one;
  for (const int ranks : {1, 2, 3, 4}) {
    run(ranks, air);
    const auto found = history();
    const std::vector<double>& volume = found.at("gas_volume");
    for (std::size_t row = 0; row < volume.size(); ++row) {
      EXPECT_GT(found.at("gas_volume_ratio")[row], 0.85);
      EXPECT_LT(found.at("gas_volume_ratio")[row], 1.02);
      EXPECT_LT(found.at("kinetic_energy")[row], 0.1);
      EXPECT_NEAR(found.at("gas_absolute_pressure")[row] * volume[row],
                  found.at("gas_amount")[row] * 8.314462618 * 293.15,
                  1e-9 * found.at("gas_absolute_pressure")[row] * volume[row]);
    }
    EXPECT_NEAR(found.at("gas_volume_ratio").back(), 1, 5e-3) << "paper does not stretch";
    EXPECT_NEAR(found.at("gas_pressure").back(), 0.05 * 101325, 0.01 * 101325);
    EXPECT_LT(found.at("kinetic_energy").back(), 1e-6);
    EXPECT_LT(std::abs(found.at("momentum_x").back()) + std::abs(found.at("momentum_y").back()), 1e-9);
    one = ranks == 1 ? found : one;
    for (const char* name : {"gas_volume", "gas_pressure"}) {
      EXPECT_NEAR(found.at(name)[3], one.at(name)[3], 1e-5 * std::abs(one.at(name)[3])) << name << " " << ranks;
    }
  }
}

TEST_F(SheetGasTest, EveryLawIsReachedWhereThePaperCanFollow) {
  // Finer, so that it folds. What it resists is left over.
  const Arguments fine{"-mesh_level",          "3",    "-sheet_thickness",       "4 mm",
                       "-sheet_perturbation",  "0.05", "-project_ksp_rtol",      "1e-3",
                       "-project_weight_red",  "0.5",  "-project_weight_green",  "0.5",
                       "-project_weight_blue", "0.5",  "-project_weight_yellow", "0.5"};
  run(1, "chambers: {air: {law: volume, volume_ratio: [[0, 1], [0.4, 0.85]]}}\n", fine);
  EXPECT_NEAR(history().at("gas_volume_ratio").back(), 0.85, 1e-2);
  EXPECT_LT(history().at("gas_pressure").back(), 0) << "it is drawn together";
  run(1, "chambers: {air: {law: adiabatic, amount_ratio: [[0, 1], [0.2, 0.9]]}}\n", fine);
  EXPECT_NEAR(history().at("gas_volume_ratio").back(), std::pow(0.9, 1 / 1.4), 1e-2) << "the air outside presses on it";
  EXPECT_NEAR(history().at("gas_absolute_pressure").back() * std::pow(history().at("gas_volume_ratio").back(), 1.4),
              0.9 * 101325, 1e-6 * 101325);
  run(1, "chambers: {air: {law: pressure, pressure: [[0, 0], [0.2, 300]]}}\n");
  EXPECT_NEAR(history().at("gas_volume_ratio").back(), 1, 5e-3) << "paper does not stretch";
  EXPECT_NEAR(history().at("gas_pressure").back(), 300, 1e-9);
  run(1, "chambers: {air: {law: relative, pressure: [[0, 0], [0.2, 300]]}}\n");
  EXPECT_NEAR(history().at("gas_pressure").back() * history().at("gas_volume_ratio").back(), 300, 1e-6);
}

TEST_F(SheetGasTest, ASheetOfOneLayerResistsNothing) {
  for (const int ranks : {1, 2}) {
    run(ranks, "chambers: {air: {law: adiabatic, amount_ratio: [[0, 1], [0.2, 0.9]]}}\n",
        {"-sheet_layers", "1", "-mesh_level", "3", "-time_step", "10 ms", "-sheet_perturbation", "0.05"});
    EXPECT_NEAR(history().at("gas_volume_ratio").back(), std::pow(0.9, 1 / 1.4), 1e-3);
    EXPECT_NEAR(history().at("gas_pressure").back(), 0, 1e-3 * 101325);
  }
}

TEST_F(SheetGasTest, TheRunEndsWithTheHoleOnAnyRanks) {
  const std::regex line("ended at .*: (chamber air is open: element [0-9]+ at \\(.*\\) m has burnt through)\n");
  std::string end;
  double mass = 0;
  for (const int ranks : {1, 2, 3, 4}) {
    const std::string printed = run(ranks, fire);
    std::smatch found;
    ASSERT_TRUE(std::regex_search(printed, found, line)) << printed;
    const auto table = history();
    EXPECT_LT(table.at("time").back(), 0.9) << "before its time";
    EXPECT_LT(table.at("mass_left").back(), 0.999 * table.at("mass_left").front());
    expect_whole_output(out_, "lantern", static_cast<int>(table.at("step").back()));
    end = ranks == 1 ? found[1].str().substr(0, 35) : end;
    mass = ranks == 1 ? table.at("mass_left").back() : mass;
    EXPECT_EQ(found[1].str().substr(0, 35), end) << ranks;
    EXPECT_NEAR(table.at("mass_left").back(), mass, 1e-6 * mass) << ranks;
  }
}

TEST_F(SheetGasTest, AStepFromACheckpointIsTheSameToTheLastBit) {
  for (const int ranks : {1, 2}) {
    const std::string printed = run(ranks, fire, {"-verify_restart", "4"});
    EXPECT_NE(printed.find("fields are the same"), std::string::npos) << printed;
  }
  run(1, "chambers: {air: {law: volume, volume_ratio: [[0, 1], [0.5, 0.8]]}}\n", {"-verify_restart", "4"});
}

TEST_F(SheetGasTest, AnElasticBallBearsThePressureOfItsGas) {
  const std::string ball = write("ball.yaml", R"(
mesh: {shape: quad_ellipsoid, level: 3, semi_axes: [0.1 m, 0.1 m, 0.1 m]}
sheet: {areal_density: 0.1, tensile_stiffness: 2000 N/m, perturbation: 0.001, damping: 5 ms}
force: {gravity: [0, 0, 0], damping: 10}
time: {step: 5 ms, end: 0.5 s}
chambers: {air: {law: isothermal, amount_ratio: [[0, 1], [0.2 s, 1.05]]}}
output: {directory: ball, name: ball}
)");
  succeed(2, {ball});
  const auto found = history_of(folder() / "ball");
  const double ratio = found.at("gas_volume_ratio").back();
  const double pressure = found.at("gas_pressure").back();
  EXPECT_NEAR((pressure + 101325) * ratio, 1.05 * 101325, 1e-3 * 101325) << "the law";
  // Stretched alike in all directions: tension (C11 + C12) e = p R / 2, with C11 = 3 G, C12 = G, G = 3/8 of 2000 N/m.
  const double strain = std::cbrt(ratio) - 1;
  EXPECT_NEAR(pressure * 0.1 * std::cbrt(ratio) / 2, 3000 * strain, 0.03 * 3000 * strain);
}

/// A ball of cloth that is blown up until it cracks.
const std::string cracking_ball = R"(
mesh: {shape: quad_ellipsoid, level: 3, semi_axes: [0.2 m, 0.2 m, 0.2 m]}
sheet: {areal_density: 0.2, tensile_stiffness: 2000 N/m, damping: 5 ms}
force: {gravity: [0, 0, 0], damping: 5}
ablation: {strength: 100 N/m, strength_scatter: 0.1}
time: {step: 1 ms, end: 0.1 s}
output: {directory: ball, name: ball}
)";

/// The first row in which there are cracks.
std::size_t first_crack(const std::map<std::string, std::vector<double>>& history) {
  const std::vector<double>& sides = history.at("cracked_sides");
  return static_cast<std::size_t>(std::find_if(sides.begin(), sides.end(), [](double n) { return n > 0; }) -
                                  sides.begin());
}

TEST_F(SheetGasTest, ABallUnderPressureCracksAtItsStrengthAndComesApart) {
  const std::string ball =
      write("ball.yaml", cracking_ball + "chambers: {air: {law: pressure, pressure: [[0, 0], [0.1, 2000]]}}\n");
  double time = 0;
  for (const int ranks : {1, 3}) {
    succeed(ranks, {ball});
    const auto found = history_of(folder() / "ball");
    const std::size_t row = first_crack(found);
    ASSERT_LT(row, found.at("time").size());
    EXPECT_TRUE(time == 0 || found.at("time")[row] == time);
    time = found.at("time")[row];
    const double radius = 0.2 * std::cbrt(found.at("gas_volume_ratio")[row]);
    EXPECT_NEAR(found.at("gas_pressure")[row] * radius / 2, 100, 0.2 * 100) << "p R / 2, but for mesh and viscosity";
    EXPECT_GT(found.at("pieces").back(), 1);
    EXPECT_NEAR(found.at("mass_left").back(), found.at("mass_left").front(), 1e-14);
  }
}

TEST_F(SheetGasTest, ABallThatBurstsLosesItsGas) {
  const std::string gas =
      "chambers: {air: {law: isothermal, hole_discharge: 0.6}}\n"
      "gas_network: {links: {pump: {to: air, flow: [[0 s, 2.6], [60 ms, 2.6], [61 ms, 0]]}}}\n";
  const std::string ball = write("ball.yaml", cracking_ball + gas);
  std::map<std::string, std::vector<double>> one;
  for (const int ranks : {1, 3}) {
    succeed(ranks, {ball});
    const auto found = history_of(folder() / "ball");
    const std::size_t row = first_crack(found);
    ASSERT_LT(row, found.at("time").size());
    EXPECT_GT(found.at("gas_pressure")[row - 1], 500);
    EXPECT_LT(found.at("gas_pressure").back(), 0.3 * found.at("gas_pressure")[row - 1]);
    EXPECT_GT(found.at("gas_leak").back(), 1e-3 * found.at("gas_amount").front());
    one = ranks == 1 ? found : one;
    for (const char* column : {"gas_pressure", "gas_amount", "cracked_sides"}) {  // The same until cracks begin.
      for (std::size_t k = 0; k <= row; ++k) {
        EXPECT_NEAR(found.at(column)[k], one.at(column)[k], 1e-5 * std::abs(one.at(column)[k]) + 1e-9) << column << k;
      }
    }
  }
  // A checkpoint in the middle of it leads to the same.
  const auto step = static_cast<int>(first_crack(one)) + 3;
  EXPECT_NE(succeed(2, {ball, "-verify_restart", std::to_string(step)}).output.find("fields are the same"),
            std::string::npos);
}

TEST_F(SheetGasTest, AShellThatIsTornInTwoHasTwoChambers) {
  const std::string deck = write("torn.yaml", R"(
mesh: {shape: quad_ellipsoid, level: 3, semi_axes: [0.1 m, 0.1 m, 0.4 m]}
sheet: {areal_density: 0.1, tensile_stiffness: 2000 N/m, damping: 5 ms}
force: {gravity: [0, 0, 0], damping: 5}
pins:
  top: {box: [-1, -1, 0.3, 1, 1, 1], velocity: [0, 0, 8]}
  bottom: {box: [-1, -1, -1, 1, 1, -0.3], velocity: [0, 0, -8]}
ablation: {strength: 100 N/m, strength_scatter: 0.02}
chambers: {air: {law: adiabatic, hole_discharge: 0.02}}
time: {step: 0.5 ms, end: 12 ms}
output: {directory: torn, name: torn}
)");
  for (const int ranks : {1, 2}) {
    const std::string printed = succeed(ranks, {deck}).output;
    EXPECT_NE(printed.find("chamber air is cut in 2 of"), std::string::npos) << printed;
    // One of the parts, which may be cut again first.
    EXPECT_TRUE(std::regex_search(printed, std::regex("chamber air\\S* is open for good"))) << printed;
    const auto found = history_of(folder() / "torn");
    for (std::size_t row = 1; row < found.at("time").size(); ++row) {
      EXPECT_LT(found.at("gas_pressure")[row], 2000) << "no jump at " << found.at("time")[row];
      EXPECT_NEAR(found.at("gas_amount")[row] + found.at("gas_leak")[row], found.at("gas_amount")[0], 1e-12);
      EXPECT_NEAR(found.at("gas_temperature")[row], 293.15, 2);
    }
    EXPECT_NE(succeed(ranks, {deck, "-verify_restart", "15"}).output.find("fields are the same"), std::string::npos);
  }
}

TEST_F(SheetGasTest, PressureActsOnWhatIsLeftAndNoCellIsTakenOut) {
  const std::string printed = run(2, fire,
                                  {"-chambers_air_law", "pressure", "-chambers_air_amount_ratio", "",
                                   "-chambers_air_pressure", "0,50", "-time_end", "0.6"});
  EXPECT_EQ(printed.find("is open"), std::string::npos) << printed;
  EXPECT_EQ(printed.find("cells are gone"), std::string::npos) << printed;
  EXPECT_LT(history().at("mass_left").back(), 0.95 * history().at("mass_left").front());
}

TEST_F(SheetGasTest, BadInputIsRefusedInOneLine) {
  const auto expect_refused = [this](const std::string& scene, const Arguments& arguments, const std::string& words) {
    const std::string air = "chambers: {air: {law: isothermal}}\n";
    const CommandResult result = pellicle(1, Arguments{write("scene.yaml", scene + air)} + arguments);
    EXPECT_EQ(result.exit_code, 1) << result;
    EXPECT_EQ(result.error_lines().size(), 1U) << result;
    EXPECT_NE(result.errors.find(words), std::string::npos) << result;
  };
  expect_refused(
      "mesh: {shape: rectangle}\n", {},
      "chambers.air.law: isothermal needs a volume, expected a closed mesh, hole_discharge or the law pressure");
  expect_refused(lantern, {"-gas_tangent", "rank1"},
                 "-gas_tangent: has no effect in this run; expected with chain: inflate");
  expect_refused(lantern, {"-ablation_loss_mass", "0.4", "-ablation_compact_fraction", "0.5"},
                 "-ablation_compact_fraction: has no effect in this run; expected with no chambers");
  expect_refused(lantern, {"-chambers_air_vertex", "5000"}, "chambers.air.vertex: 5000 is no vertex of the mesh");
}

}  // namespace
}  // namespace pellicle::sheet_gas_test
