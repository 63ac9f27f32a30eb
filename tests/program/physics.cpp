// What the scenes must show, at the level of the program.

#include <algorithm>
#include <cmath>

#include "tests/support/frames.h"
#include "tests/support/program.h"
#include "tests/support/shared_folder.h"

namespace pellicle {
namespace {

class PhysicsTest : public ProgramTest {};

TEST_F(PhysicsTest, NothingHappensToASheetAtRest) {
  const std::string deck = write("rest.yaml",
                                 "mesh: {shape: rectangle, cells: [10, 10], size: [1 m, 1 m]}\n"
                                 "sheet: {thickness: 2 cm, perturbation: 0}\n"
                                 "force: {gravity: [0, 0, 0]}\n"
                                 "output: {directory: out}\n");
  for (const char* dynamics : {"projection", "spring"}) {
    succeed(2, {deck, "-time_max_steps", "10", "-dynamics", dynamics});
    const auto history = read_csv(folder() / "out" / "history.csv");
    for (const double energy : history.at("kinetic_energy")) {
      EXPECT_EQ(energy, 0) << dynamics;
    }
    const auto frames = read_pvd(folder() / "out" / "rest.pvd");
    const DrawnFrame first = read_frame(0, frames.front().second);
    expect_same_fields(first, last_frame(folder() / "out" / "rest.pvd"), 0, dynamics);
  }
}

TEST_F(PhysicsTest, TorusStaysOnTheSphereAndFallsThroughWithHookeSprings) {
  const auto mean_height = [&](const std::string& deck, const Arguments& laid_over = {}) {
    succeed(2, Arguments{deck_path(deck), "-mesh_cells", "32,12", "-output_directory", "out", "-output_name", "torus",
                         "-output_interval_time", "1 s"} +
                   laid_over);
    return mean_of(last_frame(folder() / "out" / "torus.pvd").points.at("position"), 2);
  };
  EXPECT_GT(mean_height("torus_on_sphere"), 0.1) << "stays above the sphere's centre";
  EXPECT_GT(mean_height("torus_on_sphere", {deck_path("paper_sheet")}), 0.1) << "projected";
  EXPECT_LT(mean_height("torus_on_sphere_spring"), -0.3) << "falls past the sphere's centre";
}

TEST_F(PhysicsTest, ACurvedRoofStaysCurvedWithoutFire) {
  succeed(2, {deck_path("roof"), "-mesh_cells", "20,20", "-sheet_thickness", "15 mm", "-time_max_steps", "50",
              "-heat_sources_fire_rate", "0", "-sheet_perturbation", "0", "-output_directory", "out",
              "-output_interval_time", "0", "-output_interval_steps", "50"});
  const auto frames = read_pvd(folder() / "out" / "roof.pvd");
  ASSERT_EQ(frames.size(), 2u);
  const DrawnFrame first = read_frame(0, frames.front().second);
  const DrawnFrame last = last_frame(folder() / "out" / "roof.pvd");
  EXPECT_EQ(range_of(last.points.at("mass_ratio")).first, 1);
  const auto [bottom, top] = range_of(first.points.at("position"), 2);
  EXPECT_GT(top - bottom, 0.2) << "it is curved to begin with";
  double moved = 0;
  for (const auto& [id, start] : first.points.at("position")) {
    const std::vector<double>& end = last.points.at("position").at(id);
    moved = std::max(moved, std::hypot(end[0] - start[0], end[1] - start[1], end[2] - start[2]));
  }
  RecordProperty("moved", std::to_string(moved));
  EXPECT_LT(moved, 0.02 * (top - bottom));
}

class RealMeshTest : public ProgramTest, public testing::WithParamInterface<std::string> {};

TEST_P(RealMeshTest, BurnsUnderAHotSpot) {
  const std::filesystem::path mesh = shared_folder() / "meshes" / GetParam();
  if (!std::filesystem::exists(mesh)) {
    GTEST_SKIP() << mesh << " is not there";
  }
  const bool is_roof = GetParam() == "roof_quads.off";
  const std::string deck = write("real.yaml", "mesh: {file: " + std::filesystem::canonical(mesh).string() +
                                                  ", scale: " + (is_roof ? "0.02" : "1") +
                                                  "}\n"
                                                  "sheet: {thickness: 5 mm, areal_density: 1}\n"
                                                  "time: {step: 2 ms, max_steps: 20}\n"
                                                  "force: {gravity: [0, 0, 0]}\n"
                                                  "output: {directory: out, interval_steps: 20}\n");
  // The hot spot sits where the first vertex is.
  succeed(2, {deck, "-time_max_steps", "1"});
  const std::vector<double> place = last_frame(folder() / "out" / "real.pvd").points.at("position").at(0);
  const std::string hot =
      write("hot.yaml", "heat:\n  sources:\n    spot: {shape: ball, radius: 0.3 m, rate: 100, centre: [" +
                            std::to_string(place[0]) + ", " + std::to_string(place[1]) + ", " +
                            std::to_string(place[2]) + "]}\n");
  succeed(2, {deck, hot});
  const auto history = read_csv(folder() / "out" / "history.csv");
  EXPECT_EQ(history.at("step").back(), 20);
  EXPECT_GT(history.at("mass_burnt").back(), 0);
  const double mass = history.at("mass_left").front();
  for (std::size_t row = 0; row < history.at("step").size(); ++row) {
    EXPECT_NEAR(history.at("mass_left")[row] + history.at("mass_burnt")[row], mass, 1e-12 * mass);
  }
  const DrawnFrame last = last_frame(folder() / "out" / "real.pvd");
  EXPECT_GT(range_of(last.points.at("temperature")).second, 500);
  EXPECT_LT(range_of(last.points.at("mass_ratio")).first, 1);
  EXPECT_EQ(last.points.at("position").size(), is_roof ? 1963u + 1838 : 2930u + 2928);
}

INSTANTIATE_TEST_SUITE_P(Meshes, RealMeshTest, testing::Values("spot_quads.obj", "roof_quads.off"),
                         [](const auto& mesh) { return mesh.param.substr(0, mesh.param.find('.')); });

}  // namespace
}  // namespace pellicle
