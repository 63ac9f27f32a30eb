// Balloons through the whole program: history, gas laws, lengths of steps, rest states and failures.

#include <algorithm>
#include <cmath>

#include "tests/support/frames.h"
#include "tests/support/program.h"

namespace pellicle {
namespace {

const std::string sphere_deck = std::string(PELLICLE_SOURCE_DIR) + "/input/inflate_sphere.yaml";

class BalloonRunsTest : public ProgramTest {
 protected:
  using History = std::map<std::string, std::vector<double>>;

  /// Runs the deck of the sphere with few vertices; more decks may be among the options. @returns its history
  History run(int ranks, const Arguments& options) {
    const CommandResult result = succeed(ranks, sphere() + options);
    EXPECT_EQ(result.errors, "");
    return history();
  }

  static Arguments sphere() { return {sphere_deck, "-mesh_level", "2", "-output_directory", "out"}; }
  std::filesystem::path pvd() const { return folder() / "out" / "inflate_sphere.pvd"; }
  History history() const { return read_csv(folder() / "out" / "history.csv"); }

  static double largest(const std::vector<double>& values) { return *std::max_element(values.begin(), values.end()); }
};

TEST_F(BalloonRunsTest, TheHistoryHasARowForEachStep) {
  const History history = run(2, {"-time_max_steps", "5"});
  for (const char* name : {"time", "gas_volume", "gas_pressure", "rubber_volume_ratio", "newton_iterations",
                           "linear_iterations", "inverted_elements", "kinetic_energy"}) {
    ASSERT_EQ(history.count(name), 1U) << name;
    EXPECT_EQ(history.at(name).size(), 6U) << name;
  }
  EXPECT_EQ(text_of(folder() / "out" / "history.csv").find("time [s],step"), 0U) << "units stand in brackets";
  EXPECT_NEAR(history.at("gas_volume")[0], 4.1887902e-3, 1e-12) << "mesh.volume";
  EXPECT_NEAR(history.at("gas_pressure")[0], 0, 1e-12);
  EXPECT_GT(history.at("gas_volume")[5], history.at("gas_volume")[4]);
  EXPECT_EQ(history.at("newton_iterations")[0], 0);
  EXPECT_LE(largest(history.at("newton_iterations")), 3) << "the paper's count";
  EXPECT_EQ(largest(history.at("inverted_elements")), 0);
  EXPECT_EQ(read_pvd(pvd()).size(), 6U);
}

TEST_F(BalloonRunsTest, TheRubberKeepsItsVolumeByEitherRule) {
  for (const char* rule : {"incompressible", "global"}) {
    const History history = run(2, {"-prism_thickness", rule, "-time_max_steps", "60"});
    EXPECT_GT(history.at("gas_volume_ratio").back(), 2.5) << rule;
    for (const double ratio : history.at("rubber_volume_ratio")) {
      EXPECT_NEAR(ratio, 1, 2e-9) << rule;
    }
  }
}

TEST_F(BalloonRunsTest, NoForceOnAFreeBalloonAsAWhole) {
  const History history = run(2, {"-time_max_steps", "30", "-prism_ksp_rtol", "1e-10", "-sheet_perturbation", "0.1"});
  const double momentum = std::sqrt(2 * largest(history.at("kinetic_energy")) * 0.0377);  // of all its mass
  for (const char* name : {"momentum_x", "momentum_y", "momentum_z"}) {
    for (const double value : history.at(name)) {
      EXPECT_LT(std::abs(value), 1e-7 * momentum) << name;
    }
  }
}

TEST_F(BalloonRunsTest, ThePapersGasLaw) {
  const History history = run(2, {"-time_max_steps", "60"});
  for (std::size_t row = 0; row < history.at("time").size(); ++row) {
    const double initial_pressure = 4437.512 * std::min(1.0, history.at("time")[row] / 0.5);
    EXPECT_NEAR(history.at("gas_pressure")[row] * history.at("gas_volume")[row], initial_pressure * 4.1887902e-3,
                1e-10 * 4437.512 * 4.1887902e-3)
        << row;
  }
}

TEST_F(BalloonRunsTest, ThePumpAgainstTheAmbientPressure) {
  // Thrice the air that fills the undeformed balloon, blown in within half a second.
  constexpr double ambient_pressure = 101325;   // [Pa]
  constexpr double gas_constant = 8.314462618;  // [J/(mol K)]
  const std::string pump = write("pump.yaml",
                                 "chambers: {gas: {pressure: [], amount_ratio: [[0, 1], [0.5, 3]]}}\n"
                                 "wall: {material: mooney_rivlin}\n");
  for (const std::string law : {"isothermal", "adiabatic"}) {
    const History history = run(2, {pump, "-chambers_gas_law", law, "-time_max_steps", "60"});
    const double gamma = law == "isothermal" ? 1 : 1.4;
    const double volume = history.at("gas_volume")[0];
    for (std::size_t row = 0; row < history.at("time").size(); ++row) {
      const double amount = std::min(3.0, 1 + 4 * history.at("time")[row]);
      const double ratio = history.at("gas_volume")[row] / volume;
      const double pressure = ambient_pressure * amount * std::pow(ratio, -gamma);
      EXPECT_NEAR(history.at("gas_absolute_pressure")[row] / pressure, 1, 1e-10) << law << row;
      EXPECT_NEAR(history.at("gas_pressure")[row] + ambient_pressure, pressure, 1e-10 * pressure) << law << row;
      EXPECT_NEAR(history.at("gas_absolute_pressure")[row] * history.at("gas_volume")[row] /
                      (history.at("gas_amount")[row] * gas_constant * history.at("gas_temperature")[row]),
                  1, 1e-10)
          << law << row;
    }
    EXPECT_NEAR(history.at("gas_temperature").back(),
                293.15 * std::pow(history.at("gas_volume").back() / volume, 1 - gamma), 1e-8)
        << law;
    EXPECT_GT(history.at("gas_volume").back(), 1.9 * volume) << law;
    EXPECT_GT(history.at("gas_pressure").back(), 0) << law;
  }
}

TEST_F(BalloonRunsTest, StepsByToleranceGoTheSameWayInFewer) {
  const Arguments times{"-time_end", "0.6", "-output_interval_time", "0.1"};
  const History fine = run(1, times + Arguments{"-time_step", "1 ms"});
  const History history = run(2, times + Arguments{"-time_tolerance", "1e-3", "-time_max_step", "0.1 s"});
  EXPECT_LT(history.at("step").back(), 100);
  EXPECT_LT(*std::min_element(history.at("time_step").begin() + 1, history.at("time_step").end()),
            0.5 * largest(history.at("time_step")))
      << "its steps differ";
  const auto frames = read_pvd(pvd());
  ASSERT_EQ(frames.size(), 7U);
  for (std::size_t frame = 0; frame < frames.size(); ++frame) {
    EXPECT_NEAR(frames[frame].first, 0.1 * static_cast<double>(frame), 1e-9) << "steps end at the frames";
  }
  for (std::size_t row = 0; row < history.at("time").size(); ++row) {
    const auto same_time = static_cast<std::size_t>(std::lround(history.at("time")[row] / 1e-3));
    EXPECT_NEAR(history.at("gas_volume_ratio")[row] / fine.at("gas_volume_ratio")[same_time], 1, 0.02)
        << history.at("time")[row];
  }
}

TEST_F(BalloonRunsTest, EveryWayToTheSameRest) {
  // Without inertia and drag nothing but these planes keeps the balloon in its place.
  const std::string planes = write("planes.yaml",
                                   "symmetry: {x: {normal: [1, 0, 0]}, y: {normal: [0, 1, 0]}, z: {normal: [0, 0, "
                                   "1]}}\n");
  const Arguments to_rest{planes, "-output_interval_steps", "1000", "-time_end", "2 s", "-prism_ksp_rtol", "1e-10"};
  const History history = run(1, to_rest);
  const DrawnFrame dynamic = last_frame(pvd());
  EXPECT_NEAR(history.at("gas_volume_ratio").back(), 3, 0.03) << "three times the volume, but for the facets";
  EXPECT_LT(history.at("kinetic_energy").back(), 1e-15);
  for (const Arguments& displacement :
       {Arguments{"-prism_inertia", "false", "-prism_mass_damping", "0", "-prism_newton", "converged",
                  "-prism_snes_max_it", "50", "-time_step", "0.05"},
        {"-prism_inertia", "false", "-time_step", "0.01"},
        {"-prism_mass_damping", "0", "-prism_stiffness_damping", "2 ms"},
        {"-prism_mat_type", "shell", "-time_tolerance", "1e-3"}}) {
    run(2, to_rest + displacement);
    const DrawnFrame rest = last_frame(pvd());
    EXPECT_LT(relative_difference(dynamic.points.at("position"), rest.points.at("position")), 1e-6)
        << displacement[0] << displacement[2];
  }
}

TEST_F(BalloonRunsTest, StiffnessDampingStopsTheOscillation) {
  // All gas at once: the balloon overshoots and swings, the less the more its wall resists being stretched.
  const Arguments blow{"-prism_mass_damping",
                       "0",
                       "-time_step",
                       "0.5 ms",
                       "-time_max_steps",
                       "100",
                       "-chambers_gas_pressure",
                       "0,4437.512",
                       "-output_interval_steps",
                       "1000"};
  double energy = 1e3;  // [J]
  double overshoot = 1e3;
  for (const char* damping : {"0", "0.5 ms", "2 ms"}) {
    const History history = run(1, blow + Arguments{"-prism_stiffness_damping", damping});
    const double peak = largest(history.at("gas_volume_ratio"));
    EXPECT_GT(peak, 3.1) << damping;
    EXPECT_LT(peak, 0.95 * overshoot) << damping;
    const std::vector<double>& kinetic = history.at("kinetic_energy");
    const double left = *std::max_element(kinetic.end() - 20, kinetic.end());
    EXPECT_LT(left, 0.3 * energy) << damping;
    overshoot = peak;
    energy = left;
  }
}

TEST_F(BalloonRunsTest, AStepThatFailsIsTriedWithHalfItsLength) {
  const History history =
      run(2, {"-time_step", "0.1", "-time_max_steps", "10", "-prism_newton", "converged", "-prism_snes_max_it", "4"});
  EXPECT_GT(history.at("retries")[1], 0);
  EXPECT_NEAR(history.at("time_step")[1], 0.1 * std::pow(0.5, history.at("retries")[1]), 1e-12);
  EXPECT_NEAR(history.at("time_step")[2], 2 * history.at("time_step")[1], 1e-12) << "and grows again";
  EXPECT_LE(largest(history.at("newton_iterations")), 4);
  EXPECT_LT(largest(history.at("time_step")), 0.1 + 1e-12);
}

TEST_F(BalloonRunsTest, AFailedRunKeepsTheLastGoodState) {
  // From 50 ms on the pressure rises to absurd values.
  for (const int ranks : {1, 3}) {
    const CommandResult result =
        pellicle(ranks, sphere() + Arguments{"-chambers_gas_pressure", "0,0; 0.02,100; 0.05,100; 0.06,1e12",
                                             "-prism_newton", "converged", "-prism_snes_max_it", "30",
                                             "-time_max_retries", "3", "-output_interval_steps", "100"});
    EXPECT_EQ(result.exit_code, 1) << result;
    const std::vector<std::string> lines = result.error_lines();
    ASSERT_EQ(lines.size(), 1U) << result;
    for (const char* text : {"pellicle: step 6 at time 0.05", "failed", "0.00125 s", "last frame",
                             "the state in which it failed is ", "_failed.pvd"}) {
      EXPECT_NE(lines[0].find(text), std::string::npos) << text << " is not in: " << lines[0];
    }
    const auto frames = read_pvd(pvd());
    ASSERT_EQ(frames.size(), 2U);
    EXPECT_NEAR(frames[1].first, 0.05, 1e-12);
    const DrawnFrame last = last_frame(pvd());
    EXPECT_EQ(last.points.at("position").size(), 162U);
    EXPECT_LT(range_of(last.cell_values.at("stretch")).second, 1.02) << "the state before the burst";
    EXPECT_EQ(history().at("step").back(), 5);
    const std::filesystem::path failed = pvd().replace_extension("").string() + "_failed.pvd";
    const auto failed_frames = read_pvd(failed);
    ASSERT_EQ(failed_frames.size(), 1U);
    EXPECT_NEAR(failed_frames[0].first, 0.05125, 1e-12) << "where the last try was to end";
    const DrawnFrame state = last_frame(failed);
    EXPECT_EQ(state.points.at("position").size(), 162U);
    EXPECT_GT(relative_difference(state.points.at("position"), last.points.at("position")), 1e-4) << "on its way";
    EXPECT_NE(text_of(pvd().parent_path() / "run_files.txt").find("_failed.pvd\n"), std::string::npos);
  }
}

}  // namespace
}  // namespace pellicle
