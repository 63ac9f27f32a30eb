// Balloons: the fields do not depend on the number of ranks or on the partition.

#include <map>

#include "tests/support/balloon_scene.h"
#include "tests/support/frames.h"
#include "tests/support/program.h"

namespace pellicle {
namespace {

/// Twenty steps that are solved to the end, so that only rounding is left.
const Arguments exactly{"-time_max_steps",    "20", "-output_interval_steps", "20",    "-prism_newton",   "converged",
                        "-prism_snes_max_it", "50", "-prism_snes_rtol",       "1e-10", "-prism_ksp_rtol", "1e-10"};

class BalloonRanksTest : public ProgramTest {
 protected:
  /// Runs decks. @returns the last frame.
  DrawnFrame run(int ranks, const Arguments& decks_and_options) {
    const std::string out = "out" + std::to_string(++runs_);
    succeed(ranks, decks_and_options + Arguments{"-output_directory", out, "-output_name", "scene"});
    history_ = read_csv(folder() / out / "history.csv");
    return last_frame(folder() / out / "scene.pvd");
  }

  static std::string deck(const std::string& name) {
    return std::string(PELLICLE_SOURCE_DIR) + "/input/" + name + ".yaml";
  }

  std::map<std::string, std::vector<double>> history_;  ///< of the last run

 private:
  int runs_ = 0;
};

TEST_F(BalloonRanksTest, TheSphere) {
  const Arguments sphere = Arguments{deck("inflate_sphere"), "-mesh_level", "3"} + exactly;
  const DrawnFrame one = run(1, sphere);
  EXPECT_EQ(one.points.at("position").size(), 642U);
  EXPECT_GT(history_.at("gas_volume_ratio").back(), 1.3) << "it swells";
  for (const int ranks : {2, 3, 4}) {
    const DrawnFrame frame = run(ranks, sphere);
    EXPECT_EQ(frame.ranks.size(), static_cast<std::size_t>(ranks));
    expect_same_balloon(one, frame, agreement, std::to_string(ranks) + " ranks");
  }
}

TEST_F(BalloonRanksTest, ATeddyWithVolumePreservation) {
  // The paper's way, three Newton iterations a step, each solved exactly; the gas comes gently, as the deck has it.
  const Arguments teddy{deck("teddy"), "-mesh_vertices",         "1500",  "-time_max_steps",
                        "20",          "-output_interval_steps", "20",    "-prism_snes_rtol",
                        "1e-14",       "-prism_ksp_rtol",        "1e-12", "-volume_tolerance",
                        "1e-13"};
  const DrawnFrame one = run(1, teddy);
  EXPECT_GT(history_.at("gas_volume_ratio").back(), 1.05) << "it swells";
  EXPECT_NEAR(history_.at("rubber_volume_ratio").back(), 1, 1e-12);
  for (const int ranks : {2, 3, 4}) {
    expect_same_balloon(one, run(ranks, teddy), agreement, std::to_string(ranks) + " ranks");
  }
}

TEST_F(BalloonRanksTest, EveryPartitionerInASceneWithEverything) {
  write("balloons.obj", balloon_scene_mesh());
  const std::string scene = write("scene.yaml", balloon_scene);
  const DrawnFrame one = run(1, {scene});
  EXPECT_EQ(one.points.at("position").size(), 162U + 91);
  EXPECT_GT(history_.at("gas_volume_ball").back(), 1.3 * history_.at("gas_volume_ball").front()) << "the ball swells";
  EXPECT_GT(history_.at("gas_volume_dome").back(), 1.1 * history_.at("gas_volume_dome").front()) << "the dome swells";
  const std::map<std::string, std::vector<int>> rank_counts{
      {"metis", {2, 3, 4}}, {"ptscotch", {2, 4}}, {"simple", {3, 4}}};
  for (const auto& [partitioner, counts] : rank_counts) {
    for (const int ranks : counts) {
      const DrawnFrame frame = run(ranks, {scene, "-sheet_partitioner", partitioner});
      EXPECT_EQ(frame.ranks.size(), static_cast<std::size_t>(ranks)) << partitioner << ": every rank owns elements";
      expect_same_balloon(one, frame, agreement, partitioner + " on " + std::to_string(ranks) + " ranks");
    }
  }
}

TEST_F(BalloonRanksTest, ASceneWithEverythingByGeneralizedAlpha) {
  write("balloons.obj", balloon_scene_mesh());
  const Arguments scene{write("scene.yaml", balloon_scene), "-time_scheme", "generalized_alpha", "-time_max_steps",
                        "20"};
  const DrawnFrame one = run(1, scene);
  EXPECT_GT(history_.at("gas_volume_ball").back(), 1.3 * history_.at("gas_volume_ball").front()) << "the ball swells";
  for (const int ranks : {2, 3, 4}) {
    expect_same_balloon(one, run(ranks, scene), agreement, std::to_string(ranks) + " ranks");
  }
}

TEST_F(BalloonRanksTest, PrescribedVolumeAndQuasiStatic) {
  write("balloons.obj", balloon_scene_mesh());
  const Arguments scene{write("scene.yaml", balloon_scene),
                        write("more.yaml",
                              "chambers:\n"
                              "  ball: {law: volume, pressure: [], volume_ratio: [[0, 1], [0.1, 2]]}\n"
                              "prism: {inertia: false, stiffness_damping: 0}\n")};
  const DrawnFrame one = run(1, scene);
  EXPECT_NEAR(history_.at("gas_volume_ball").back(), 2 * history_.at("gas_volume_ball").front(),
              1e-9 * history_.at("gas_volume_ball").front());
  for (const int ranks : {2, 4}) {
    expect_same_balloon(one, run(ranks, scene), agreement, std::to_string(ranks) + " ranks");
  }
}

TEST_F(BalloonRanksTest, ThePathThroughTheLimitPointsAlsoFromACheckpoint) {
  const Arguments path{deck("limit_points"), "-mesh_level", "2", "-prism_snes_rtol", "1e-10",
                       "-prism_ksp_rtol",    "1e-10"};
  const DrawnFrame one = run(1, path);
  const std::vector<double> load_time = history_.at("load_time");
  EXPECT_LT(load_time.back(), load_time[5]) << "it has gone back";
  EXPECT_GT(load_time.back(), load_time[21]) << "and forth";
  for (const int ranks : {2, 4}) {
    expect_same_balloon(one, run(ranks, path), agreement, std::to_string(ranks) + " ranks");
    EXPECT_NEAR(history_.at("load_time").back(), load_time.back(), 1e-7);
  }
  const std::string printed =
      succeed(2, path + Arguments{"-verify_restart", "8", "-output_directory", "verified"}).output;
  EXPECT_NE(printed.find("fields are the same"), std::string::npos) << printed;
}

TEST_F(BalloonRanksTest, WhereMostIsHeld) {
  // The preconditioner's patches of vertices that cannot move, or of very few.
  const Arguments sphere =
      Arguments{deck("inflate_sphere"), write("half.yaml", "pins: {half: {box: [-1, -1, -1, 1, 1, 0.03]}}\n"),
                "-mesh_level",          "2",
                "-prism_patch_size",    "10"} +
      exactly;
  const DrawnFrame one = run(1, sphere);
  EXPECT_GT(history_.at("gas_volume_ratio").back(), 1.1) << "the rest swells";
  for (const int ranks : {2, 4}) {
    expect_same_balloon(one, run(ranks, sphere), agreement, std::to_string(ranks) + " ranks");
  }
}

TEST_F(BalloonRanksTest, RanksWithoutElements) {
  // A tetrahedron of four elements on four ranks, and a stretched icosahedron of twenty.
  write("tetrahedron.obj", "v 1 1 1\nv 1 -1 -1\nv -1 1.5 -1\nv -2 -1 1\nf 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n");
  const std::map<std::string, Arguments> meshes{
      {"tetrahedron", {"-mesh_file", (folder() / "tetrahedron.obj").string()}},
      {"icosahedron", {"-mesh_shape", "ellipsoid", "-mesh_semi_axes", "0.1,0.07,0.15", "-mesh_level", "0"}}};
  for (const auto& [name, mesh] : meshes) {
    const Arguments balloon = Arguments{deck("inflate_sphere")} + mesh + exactly;
    const DrawnFrame one = run(1, balloon);
    EXPECT_GT(history_.at("gas_volume_ratio").back(), 1.2) << name;
    for (const char* partitioner : {"metis", "ptscotch", "simple"}) {
      for (const Arguments& more : {Arguments{}, {"-prism_mat_type", "shell", "-prism_thickness", "global"}}) {
        const Arguments options = balloon + more;
        const DrawnFrame four = run(4, options + Arguments{"-sheet_partitioner", partitioner});
        expect_same_balloon(more.empty() ? one : run(1, options), four, agreement, name + " with " + partitioner);
      }
    }
  }
}

}  // namespace
}  // namespace pellicle
