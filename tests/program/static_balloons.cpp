// Balloons that come to rest, or cannot: decks with known answers, and the pressure beyond a limit point.

#include <cmath>

#include "tests/support/frames.h"
#include "tests/support/program.h"

namespace pellicle {
namespace {

class StaticBalloonsTest : public ProgramTest {
 protected:
  /// Runs a deck of input/. @returns its last frame.
  DrawnFrame run_deck(const std::string& name, const Arguments& more = {}) {
    const std::string deck = std::string(PELLICLE_SOURCE_DIR) + "/input/" + name + ".yaml";
    succeed(2, Arguments{deck, "-output_directory", "out"} + more);
    const auto history = read_csv(folder() / "out" / "history.csv");
    EXPECT_LT(history.at("kinetic_energy").back(), 1e-6 * history.at("elastic_energy").back()) << "not at rest";
    return last_frame(folder() / "out" / (name + ".pvd"));
  }

  static double centre_height(const DrawnFrame& frame) { return frame.points.at("position").at(0)[2]; }
};

TEST_F(StaticBalloonsTest, DiscRisesAsHenckySays) {
  const double height = centre_height(run_deck("disc"));
  RecordProperty("height", std::to_string(height));
  EXPECT_NEAR(height, 3.033e-3, 0.01 * 3.033e-3);
}

TEST_F(StaticBalloonsTest, AirbagRisesAsPublished) {
  const double height = centre_height(run_deck("airbag"));
  RecordProperty("height", std::to_string(height));
  EXPECT_GT(height, 0.205);
  EXPECT_LT(height, 0.2167);
}

TEST_F(StaticBalloonsTest, AirbagOfTensionFieldTheoryRisesAsPublishedOnFewCells) {
  const double height = centre_height(run_deck("airbag", {"-mesh_cells", "8,8", "-wall_wrinkling", "tension_field"}));
  RecordProperty("height", std::to_string(height));
  EXPECT_GT(height, 0.205);
  EXPECT_LT(height, 0.217);
}

TEST_F(StaticBalloonsTest, PressureBeyondTheLimitPointEndsTheRunWithTheReason) {
  // A neo-Hookean sphere holds 1.23946 mu h / R = 1487.4 Pa at most.
  const std::string deck = write("limit.yaml",
                                 "chain: inflate\n"
                                 "mesh: {shape: icosphere, level: 4, radius: 0.1 m}\n"
                                 "wall: {material: neo_hookean, mu: 0.4 MPa, thickness: 0.3 mm}\n"
                                 "prism: {inertia: false, mass_damping: 1}\n"
                                 "force: {gravity: [0, 0, 0]}\n"
                                 "chambers: {gas: {law: pressure, pressure: [[0 s, 0 Pa], [20 s, 2000 Pa]]}}\n"
                                 "time: {step: 1 s, end: 20 s}\n"
                                 "output: {directory: out, interval_time: 100 s}\n");
  const CommandResult result = pellicle(2, {deck});
  EXPECT_NE(result.exit_code, 0) << result;
  for (const char* words : {"failed", "no stable equilibrium", "highest pressure that the balloon can hold",
                            "prescribe its volume or its amount of gas", "the state before it is the last frame"}) {
    EXPECT_NE(result.errors.find(words), std::string::npos) << words << result;
  }
  const auto history = read_csv(folder() / "out" / "history.csv");
  const double highest = 1.23946 * 4e5 * 3e-4 / 0.1;
  EXPECT_NEAR(history.at("gas_pressure").back(), highest, 0.01 * highest);
  const DrawnFrame last = last_frame(folder() / "out" / "limit.pvd");
  EXPECT_NEAR(last.time, history.at("time").back(), 1e-12);
  EXPECT_EQ(pellicle(1, {deck}).exit_code, 1);
}

}  // namespace
}  // namespace pellicle
