// What a run says of the strain of its springs, and the limit that a deck sets.

#include "tests/support/burning_scene.h"
#include "tests/support/frames.h"
#include "tests/support/program.h"
#include "tests/support/run_checks.h"

namespace pellicle {
namespace {

class StrainTest : public ProgramTest {
 protected:
  /// Runs the scene. @returns the line of the log with the largest strain
  std::string largest(int ranks, const std::string& out, const Arguments& more = {}) {
    const CommandResult result =
        succeed(ranks, Arguments{write("scene.yaml", burning_scene), "-output_directory", out} + more);
    const std::size_t begin = result.output.find("largest strain of the net: ");
    EXPECT_NE(begin, std::string::npos) << result;
    return begin == std::string::npos ? "" : result.output.substr(begin, result.output.find('\n', begin) - begin);
  }

  std::map<std::string, std::vector<double>> history(const std::string& out) { return history_of(folder() / out); }
};

using StrainRanks = StrainTest;

TEST_F(StrainRanks, TellTheSameAsTheHistoryAndAsEachOther) {
  const std::string line = largest(1, "one");
  const auto table = history("one");
  const std::vector<double>& strain = table.at("largest_strain");
  const auto row =
      static_cast<std::size_t>(std::distance(strain.begin(), std::max_element(strain.begin() + 1, strain.end())));
  char expected[200];
  std::snprintf(expected, sizeof expected, "largest strain of the net: %.3g %% at (%.4g, %.4g, %.4g) m, %.6g s",
                100 * strain[row], table.at("largest_strain_x")[row], table.at("largest_strain_y")[row],
                table.at("largest_strain_z")[row], table.at("time")[row]);
  EXPECT_EQ(line, expected);
  EXPECT_GT(strain[row], 0.01);
  EXPECT_LT(table.at("mean_strain")[row], strain[row]);
  for (const int ranks : {2, 3, 4}) {
    const std::string out = "out" + std::to_string(ranks);
    EXPECT_EQ(largest(ranks, out), line) << ranks;
    for (const char* column : {"largest_strain_id_1", "largest_strain_id_2"}) {
      EXPECT_EQ(history(out).at(column)[row], table.at(column)[row]) << ranks << " ranks: " << column;
    }
  }
}

TEST_F(StrainRanks, KeepTheLimitAlike) {
  const Arguments limit{"-project_strain_limit", "0.01", "-project_strain_steps", "50"};
  largest(1, "one", limit);
  const std::vector<double> strain = history("one").at("largest_strain");
  EXPECT_LE(*std::max_element(strain.begin() + 1, strain.end()), 0.01);
  const DrawnFrame one = last_frame(folder() / "one" / "scene.pvd");
  for (const int ranks : {2, 4}) {
    const std::string out = "out" + std::to_string(ranks);
    largest(ranks, out, limit);
    expect_same_fields(one, last_frame(folder() / out / "scene.pvd"), 1e-5, out);
  }
}

TEST_F(StrainTest, ARunThatGoesOnKnowsOfTheStrainBefore) {
  const Arguments checkpoints{"-checkpoint_interval_steps", "15"};
  // The largest comes early: noise that fades, and no more.
  const Arguments scene = checkpoints + Arguments{"-sheet_perturbation", "0.1", "-force_damping", "200"} +
                          Arguments{"-force_gravity", "0,0,0", "-bodies_ball_velocity", "0,0,0"} +
                          Arguments{"-combustion_ignition_temperature", "5000"};
  const std::string line = largest(1, "whole", scene);
  const std::vector<double> strain = history("whole").at("largest_strain");
  ASSERT_LT(std::distance(strain.begin(), std::max_element(strain.begin() + 1, strain.end())), 15);
  largest(1, "cut", scene + Arguments{"-time_max_steps", "15"});
  EXPECT_EQ(largest(1, "cut", scene + Arguments{"-restart", "cut"}), line);
}

TEST_F(StrainTest, AStepThatCannotKeepTheLimitFailsByName) {
  // Clamped on two sides, of which one moves away: no net of these lengths fits between them.
  const Arguments deck{write("clamped.yaml", R"(
mesh: {cells: [8, 4], size: [1 m, 0.5 m]}
pins: {left: {box: [-0.51, -1, -1, -0.49, 1, 1]}, right: {box: [0.49, -1, -1, 0.51, 1, 1], velocity: [5 m/s, 0, 0]}}
time: {max_retries: 1, max_steps: 3}
project: {strain_limit: 0.01}
)")};
  for (const char* dynamics : {"projection", "elastic"}) {
    const CommandResult result = pellicle(1, deck + Arguments{"-dynamics", dynamics});
    EXPECT_EQ(result.exit_code, 1) << result;
    for (const char* words : {"spring of particles ", " is strained by ", ") m, above project.strain_limit 0.01"}) {
      EXPECT_NE(result.errors.find(words), std::string::npos) << words << " is not in: " << result;
    }
    EXPECT_NE(result.output.find("tried again with"), std::string::npos) << result;
  }
}

/// A strip of so little stiffness that its weight would stretch it by half of its length on average.
const char* const heavy_strip = R"(
mesh: {cells: [4, 16], size: [0.25 m, 1 m]}
sheet: {areal_density: 1 kg/m^2, tensile_stiffness: 10 N/m, damping: 5 ms, perturbation: 0.01}
pins: {top: {box: [-1, 0.499, -1, 1, 0.501, 1]}}
force: {gravity: [0, -9.81 m/s^2, 0], damping: 2}
time: {step: 5 ms, end: 0.12}
elastic: {newton_tolerance: 1e-6, ksp_rtol: 1e-6}
output: {directory: out, interval_steps: 24}
)";

TEST_F(StrainRanks, OfAnElasticSheetKeepTheLimitAlike) {
  const std::string deck = write("strip.yaml", heavy_strip);
  succeed(1, {deck, "-output_directory", "free"});
  const std::vector<double> free = history("free").at("largest_strain");
  EXPECT_GT(*std::max_element(free.begin(), free.end()), 0.2);
  succeed(1, {deck, "-project_strain_limit", "0.05"});
  const std::vector<double> strain = history("out").at("largest_strain");
  const double largest = *std::max_element(strain.begin(), strain.end());
  EXPECT_LE(largest, 0.05);
  EXPECT_GT(largest, 0.04) << "no less than need be";
  const DrawnFrame one = last_frame(folder() / "out" / "strip.pvd");
  for (const int ranks : {2, 3, 4}) {
    const std::string out = "out" + std::to_string(ranks);
    succeed(ranks, {deck, "-project_strain_limit", "0.05", "-output_directory", out});
    expect_same_fields(one, last_frame(folder() / out / "strip.pvd"), 1e-5, out);
  }
}

TEST_F(StrainTest, AnElasticSheetThatBurnsAndMeetsABallKeepsTheLimit) {
  const Arguments burning{write("scene.yaml", burning_scene), "-dynamics", "elastic", "-combustion_mass_loss_rate",
                          "0.5"};
  succeed(1, burning + Arguments{"-output_directory", "free"});
  const std::vector<double> free = history("free").at("largest_strain");
  EXPECT_GT(*std::max_element(free.begin() + 1, free.end()), 0.03);
  succeed(1, burning + Arguments{"-project_strain_limit", "0.02", "-output_directory", "out"});
  const std::vector<double> strain = history("out").at("largest_strain");
  EXPECT_LE(*std::max_element(strain.begin() + 1, strain.end()), 0.02);
  const std::vector<double> contacts = history("out").at("contacts");
  EXPECT_GT(*std::max_element(contacts.begin(), contacts.end()), 0);
}

}  // namespace
}  // namespace pellicle
