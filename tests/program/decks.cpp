// Every deck of input/ runs, and ParaView opens what comes out.

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>

#include "tests/support/frames.h"
#include "tests/support/program.h"

namespace pellicle {
namespace {

const std::filesystem::path source_folder{PELLICLE_SOURCE_DIR};

std::vector<std::string> decks() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(source_folder / "input")) {
    if (entry.path().extension() == ".yaml") {
      names.push_back(entry.path().stem().string());
    }
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::string deck_path(const std::string& name) { return (source_folder / "input" / (name + ".yaml")).string(); }

class DecksTest : public ProgramTest, public testing::WithParamInterface<std::string> {};

TEST_P(DecksTest, RunsTwoSteps) {
  // A deck without a mesh is a set of options to be laid over any scene.
  const bool is_scene = YAML::LoadFile(deck_path(GetParam()))["mesh"].IsDefined();
  const Arguments decks =
      is_scene ? Arguments{deck_path(GetParam())} : Arguments{deck_path("uniform_shrink"), deck_path(GetParam())};
  const CommandResult result =
      succeed(2, decks + Arguments{"-time_max_steps", "2", "-output_directory", "out", "-output_name", "deck"});
  EXPECT_EQ(result.errors, "");

  const auto frames = read_pvd(folder() / "out" / "deck.pvd");
  ASSERT_GE(frames.size(), 2u);
  const DrawnFrame frame = last_frame(folder() / "out" / "deck.pvd");
  EXPECT_GT(frame.time, 0);
  EXPECT_EQ(frame.ranks.size(), 2u);
  for (const auto& [field, values] : frame.points) {
    for (const auto& entry : values) {
      for (const double value : entry.second) {
        ASSERT_TRUE(std::isfinite(value)) << field << " of " << entry.first;
      }
    }
  }
  const auto history = read_csv(folder() / "out" / "history.csv");
  EXPECT_EQ(history.at("step").back(), 2);
  EXPECT_EQ(*std::max_element(history.at("retries").begin(), history.at("retries").end()), 0);
  const double mass = history.at("mass_left").front();
  for (std::size_t row = 0; row < 3; ++row) {
    EXPECT_NEAR(history.at("mass_left")[row] + history.at("mass_burnt")[row], mass, 1e-12 * mass);
  }
}

INSTANTIATE_TEST_SUITE_P(Input, DecksTest, testing::ValuesIn(decks()), [](const auto& deck) { return deck.param; });

class ParaViewTest : public ProgramTest {};

TEST_F(ParaViewTest, OpensARun) {
  const std::string pvbatch = (source_folder / "tools" / "pvbatch").string();
  const CommandResult modules = run_command({pvbatch, "--modules"});
  if (modules.exit_code != 0 || !std::filesystem::exists(modules.output.substr(0, modules.output.find('\n')))) {
    GTEST_SKIP() << "ParaView or its Python modules are not installed; tools/setup does that";
  }
  succeed(2, {deck_path("hot_ball"), "-mesh_cells", "12,10", "-time_max_steps", "6", "-output_interval_time", "0",
              "-output_interval_steps", "3", "-output_directory", "out", "-heat_sources_ball_centre", "-0.3,0,0"});
  const CommandResult seen =
      run_command({pvbatch, (source_folder / "postproc" / "check_output.py").string(), "out/hot_ball.pvd"});
  ASSERT_EQ(seen.exit_code, 0) << seen;
  const YAML::Node report = YAML::Load(seen.output.substr(seen.output.find("{\"times\"")));
  ASSERT_EQ(report["times"].size(), 3u) << seen;
  ASSERT_EQ(report["frames"].size(), 3u) << seen;
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(report["times"][i].as<double>(), 0.006 * static_cast<double>(i), 1e-12) << seen;
    const YAML::Node frame = report["frames"][i];
    EXPECT_EQ(frame["points"].as<int>(), 13 * 11 + 12 * 10) << seen;
    EXPECT_EQ(frame["cells"].as<int>(), 4 * 12 * 10) << seen;
  }
  // ParaView's ranges are those of the files.
  const DrawnFrame last = last_frame(folder() / "out" / "hot_ball.pvd");
  EXPECT_GT(range_of(last.points.at("temperature")).second, 310) << "the ball heats";
  for (const auto& [field, components] : {std::pair{"temperature", 1}, {"mass_ratio", 1}, {"velocity", 3}}) {
    const YAML::Node ranges = report["frames"][2]["fields"][field];
    ASSERT_EQ(ranges.size(), static_cast<std::size_t>(components)) << field << seen;
    for (int component = 0; component < components; ++component) {
      const auto [low, high] = range_of(last.points.at(field), static_cast<std::size_t>(component));
      EXPECT_NEAR(ranges[component][0].as<double>(), low, 1e-12 * std::abs(low)) << field << seen;
      EXPECT_NEAR(ranges[component][1].as<double>(), high, 1e-12 * std::abs(high)) << field << seen;
    }
  }
}

}  // namespace
}  // namespace pellicle
