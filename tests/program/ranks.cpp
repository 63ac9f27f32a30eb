// The fields do not depend on the number of ranks, on the partition or on the storage of the matrices.

#include <map>
#include <regex>

#include "tests/support/burning_scene.h"
#include "tests/support/frames.h"
#include "tests/support/program.h"

namespace pellicle {
namespace {

class RanksTest : public ProgramTest {
 protected:
  /// Runs a deck. @returns the last frame.
  DrawnFrame run(int ranks, const std::string& deck, const Arguments& options = {}) {
    const std::string out = "out" + std::to_string(++runs_);
    succeed(ranks, Arguments{write("scene.yaml", deck), "-output_directory", out} + options);
    return last_frame(folder() / out / "scene.pvd");
  }

 private:
  int runs_ = 0;
};

/// The scene must have moved, heated, burnt and touched, or agreement would say nothing.
void expect_burning_and_touch(const DrawnFrame& frame) {
  EXPECT_EQ(frame.points.at("position").size(), 21u * 21 + 20 * 20);
  EXPECT_GT(range_of(frame.points.at("temperature")).second, 600);
  EXPECT_LT(range_of(frame.points.at("mass_ratio")).first, 0.9);
  EXPECT_GT(range_of(frame.points.at("position"), 2).second, 0.02) << "the ball lifts the sheet";
}

TEST_F(RanksTest, EveryNumberOfRanksAndPartitionerAgree) {
  const DrawnFrame one = run(1, burning_scene);
  expect_burning_and_touch(one);
  const std::map<std::string, std::vector<int>> rank_counts{{"metis", {2, 3, 4}}, {"ptscotch", {4}}, {"simple", {3}}};
  for (const auto& [partitioner, counts] : rank_counts) {
    for (const int ranks : counts) {
      const DrawnFrame frame = run(ranks, burning_scene, {"-sheet_partitioner", partitioner});
      EXPECT_EQ(frame.ranks.size(), static_cast<std::size_t>(ranks)) << partitioner << ": every rank owns cells";
      expect_same_fields(one, frame, agreement, partitioner + " on " + std::to_string(ranks) + " ranks");
    }
  }
}

TEST_F(RanksTest, StorageOfTheMatricesDoesNotMatter) {
  const DrawnFrame aij = run(1, burning_scene, {"-project_mat_type", "aij", "-heat_mat_type", "aij"});
  expect_burning_and_touch(aij);
  for (const int ranks : {1, 3}) {
    for (const char* storage : {"lines", "sell", "shell"}) {
      const DrawnFrame other = run(ranks, burning_scene, {"-project_mat_type", storage, "-heat_mat_type", "shell"});
      expect_same_fields(aij, other, agreement, std::string(storage) + " on " + std::to_string(ranks) + " ranks");
    }
  }
}

TEST_F(RanksTest, OneLayerThatBurnsAway) {
  const Arguments one_layer = Arguments{"-sheet_layers", "1"} + burning_away;
  const DrawnFrame one = run(1, burning_scene, one_layer);
  EXPECT_LT(range_of(one.points.at("mass_ratio")).first, 0.7);
  for (const int ranks : {2, 3}) {
    expect_same_remains(one, run(ranks, burning_scene, one_layer), 1e-5, std::to_string(ranks) + " ranks");
  }
}

TEST_F(RanksTest, JointProjection) {
  const Arguments joint{"-project_method",    "joint", "-project_shift",    "1e-3",
                        "-project_max_steps", "1",     "-project_ksp_rtol", "1e-9"};
  const DrawnFrame one = run(1, burning_scene, joint);
  expect_burning_and_touch(one);
  expect_same_fields(one, run(3, burning_scene, joint), 1e-5, "3 ranks");
  const CommandResult verified = succeed(
      2,
      Arguments{(folder() / "scene.yaml").string(), "-verify_restart", "5", "-output_directory", "verified"} + joint);
  EXPECT_NE(verified.output.find("fields are the same"), std::string::npos) << verified;
}

TEST_F(RanksTest, RanksWithoutCells) {
  // Three cells, the last of them over the ball's top; the spot heats the first.
  const Arguments strip{"-mesh_cells", "3,1", "-mesh_size", "0.6,0.2", "-sheet_perturbation", "0"};
  const std::string deck = std::regex_replace(burning_scene, std::regex("corners: \\[[^\\]]*\\]"), "corners: [min_x]");
  const DrawnFrame one = run(1, deck, strip);
  EXPECT_EQ(one.points.at("position").size(), 8u + 3);
  EXPECT_LT(range_of(one.points.at("mass_ratio")).first, 0.99);
  for (const char* partitioner : {"metis", "ptscotch", "simple"}) {
    for (const char* dynamics : {"projection", "spring"}) {
      const bool has_springs = std::string(dynamics) == "spring";
      const Arguments tight{"-spring_ksp_rtol", "1e-12", "-spring_newton_tolerance", "1e-9"};
      const Arguments options = strip + Arguments{"-dynamics", dynamics} + (has_springs ? tight : Arguments{});
      const DrawnFrame four = run(4, deck, options + Arguments{"-sheet_partitioner", partitioner});
      EXPECT_LE(four.ranks.size(), 3u) << partitioner;
      const DrawnFrame reference = has_springs ? run(1, deck, options) : one;
      expect_same_fields(reference, four, agreement, std::string(dynamics) + " with " + partitioner);
    }
  }
}

TEST_F(RanksTest, HookeSpringsAgree) {
  const Arguments springs{"-dynamics", "spring", "-spring_newton_tolerance", "1e-9", "-spring_ksp_rtol", "1e-12"};
  const DrawnFrame one = run(1, burning_scene, springs);
  expect_burning_and_touch(one);
  for (const int ranks : {2, 3, 4}) {
    expect_same_fields(one, run(ranks, burning_scene, springs), agreement, std::to_string(ranks) + " ranks");
  }
}

TEST_F(RanksTest, ThePapersChoicesAgree) {
  const Arguments paper{"-heat_operator", "umbrella", "-project_masses", "equal"};
  const DrawnFrame one = run(1, burning_scene, paper);
  expect_same_fields(one, run(3, burning_scene, paper), agreement, "3 ranks");
}

}  // namespace
}  // namespace pellicle
