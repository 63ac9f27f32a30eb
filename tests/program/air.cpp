// Wind is the same on any number of ranks and after a restart; impossible winds are refused.

#include "tests/support/balloon_scene.h"
#include "tests/support/burning_scene.h"
#include "tests/support/frames.h"
#include "tests/support/program.h"

namespace pellicle {
namespace {

const Arguments gust{"-force_air_density",
                     "1.2",
                     "-force_skin_drag",
                     "0.05",
                     "-force_wind_velocity",
                     "0,0,0,0;20 ms,6,3,2",
                     "-force_wind_turbulence",
                     "0.3",
                     "-force_wind_turbulence_length",
                     "0.3 m"};

class AirTest : public ProgramTest {
 protected:
  DrawnFrame last(int ranks, const Arguments& scene, const std::string& out) {
    succeed(ranks, scene + Arguments{"-output_directory", out});
    return last_frame(folder() / out / "scene.pvd");
  }
};

using AirRanks = AirTest;

TEST_F(AirRanks, BlowAlikeOnAnyNumberOfThem) {
  const Arguments still{write("scene.yaml", burning_scene)};
  const DrawnFrame one = last(1, still + gust, "one");
  const DrawnFrame without = last(1, still, "without");
  EXPECT_GT(relative_difference(one.points.at("velocity"), without.points.at("velocity")), 1000 * agreement);
  for (const int ranks : {2, 3, 4}) {
    expect_same_fields(one, last(ranks, still + gust, "out" + std::to_string(ranks)), agreement,
                       std::to_string(ranks) + " ranks");
  }
}

TEST_F(AirRanks, GoOnFromCheckpointsInWind) {
  write("balloons.obj", balloon_scene_mesh());
  for (const auto& [name, text] : {std::pair{"sheet.yaml", burning_scene}, {"balloon.yaml", balloon_scene}}) {
    const CommandResult result =
        succeed(2, Arguments{write(name, text), "-verify_restart", "5", "-output_directory", "out"} + gust);
    EXPECT_NE(result.output.find("fields are the same"), std::string::npos) << result;
  }
}

TEST_F(AirTest, BadValuesAreRefused) {
  const auto refused = [this](const std::string& force, const std::vector<std::string>& words) {
    const CommandResult result = pellicle(1, {write("bad.yaml", "force: {" + force + "}\n"), "-mesh_cells", "4,4"});
    EXPECT_EQ(result.exit_code, 1) << result;
    const std::vector<std::string> lines = result.error_lines();
    ASSERT_EQ(lines.size(), 1U) << result;
    for (const std::string& word : words) {
      EXPECT_NE(lines.front().find(word), std::string::npos) << word << " is not in: " << lines.front();
    }
  };
  refused("air_density: -1", {"bad.yaml:1", "force.air_density", "-1", "at least 0"});
  refused("air_density: 1.2 kg", {"bad.yaml:1", "force.air_density", "kg/m^3"});
  refused("drag: 1.2", {"force.drag", "force.air_density: more than 0"});
  refused("air_density: 1, drag: -2", {"force.drag", "-2"});
  refused("air_density: 1, wind: {turbulence: 0.1}", {"force.wind.turbulence", "force.wind.velocity"});
  refused("air_density: 1, wind: {velocity: [[0, 1, 2]]}", {"force.wind.velocity", "4"});
  refused("air_density: 1, wind: {velocity: [[1 s, 1, 0, 0], [0 s, 1, 0, 0]]}", {"force.wind.velocity", "key point 2"});
  refused("air_density: 1, wind: {velocity: [[0, 1 m, 0, 0]]}", {"force.wind.velocity", "m/s"});
  refused("air_density: 1, wind: {velocity: [[0, 1, 0, 0]], turbulence: 3}", {"force.wind.turbulence", "0 to 2"});
  refused("air_density: 1, wind: {velocity: [[0, 1, 0, 0]], turbulence: 0.1, turbulence_length: 0}",
          {"force.wind.turbulence_length", "more than 0"});
  refused("air_density: 1, wind: {speed: 3}", {"force.wind.speed"});
}

}  // namespace
}  // namespace pellicle
