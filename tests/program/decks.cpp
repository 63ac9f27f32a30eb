// Every deck of input/ runs, and ParaView opens what comes out.

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "tests/support/frames.h"
#include "tests/support/paraview.h"
#include "tests/support/run_checks.h"

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

class DecksTest : public ProgramTest, public testing::WithParamInterface<std::string> {
 protected:
  void expect_sound_output(const std::string& object) const;
};

TEST_P(DecksTest, RunsTwoSteps) {
  // A deck without a mesh is a set of options to be laid over any scene, the solvers of the paper over a projected
  // sheet.
  const YAML::Node deck = YAML::LoadFile(deck_path(GetParam()));
  const bool is_scene = deck["mesh"].IsDefined() || deck["objects"].IsDefined();
  const std::string scene = GetParam() == "paper_solver" ? "peer_w1" : "uniform_shrink";
  const Arguments decks =
      is_scene ? Arguments{deck_path(GetParam())} : Arguments{deck_path(scene), deck_path(GetParam())};
  const CommandResult result =
      succeed(2, decks + Arguments{"-time_max_steps", "2", "-output_directory", "out", "-output_name", "deck"});
  EXPECT_EQ(result.errors, "");

  std::vector<std::string> objects;
  for (const auto& object : deck["objects"]) {
    objects.push_back(object.first.as<std::string>());
  }
  for (const std::string& object : objects.empty() ? std::vector<std::string>{""} : objects) {
    expect_sound_output(object);
  }
}

INSTANTIATE_TEST_SUITE_P(Input, DecksTest, testing::ValuesIn(decks()), [](const auto& deck) { return deck.param; });

/// Finite fields after two steps, and balances that close.
void DecksTest::expect_sound_output(const std::string& object) const {
  const auto frames = read_pvd(folder() / "out" / "deck.pvd", object);
  ASSERT_GE(frames.size(), 2u);
  const DrawnFrame frame = read_frame(frames.back().first, frames.back().second);
  EXPECT_GT(frame.time, 0);
  EXPECT_EQ(frame.ranks.size(), 2u);
  for (const auto& [field, values] : frame.points) {
    for (const auto& entry : values) {
      for (const double value : entry.second) {
        ASSERT_TRUE(std::isfinite(value)) << field << " of " << entry.first;
      }
    }
  }
  const auto history = read_csv(table_of(folder() / "out", "history", object));
  EXPECT_EQ(history.at("step").back(), 2);
  // A slack balloon's first steps may be halved, since three Newton iterations can make the residual grow.
  const bool is_balloon = history.count("newton_iterations") > 0;
  EXPECT_LE(*std::max_element(history.at("retries").begin(), history.at("retries").end()), is_balloon ? 3 : 0);
  if (history.count("mass_left") > 0) {
    const double mass = history.at("mass_left").front();
    for (std::size_t row = 0; row < 3; ++row) {
      EXPECT_NEAR(history.at("mass_left")[row] + history.at("mass_burnt")[row], mass, 1e-12 * mass);
    }
    return;
  }
  for (const auto& [field, values] : frame.cell_values) {
    for (const auto& entry : values) {
      for (const double value : entry.second) {
        ASSERT_TRUE(std::isfinite(value)) << field << " of " << entry.first;
      }
    }
  }
  EXPECT_GT(range_of(frame.cell_values.at("thickness")).first, 0);
  EXPECT_EQ(history.at("inverted_elements").back(), 0);
  const YAML::Node options = YAML::LoadFile((folder() / "out" / "options.yaml").string());
  const auto rule = (object.empty() ? options : options["objects"][object])["prism"]["thickness"].as<std::string>();
  if (rule == "incompressible" || rule == "global") {
    EXPECT_NEAR(history.at("rubber_volume_ratio").back(), 1, 1e-8);
  }
}

class PaperSolverTest : public ProgramTest {};

TEST_F(PaperSolverTest, LiesOverABalloonToo) {
  const Arguments teddy{deck_path("teddy"), "-mesh_vertices", "1500", "-output_name", "teddy", "-time_max_steps", "5"};
  // Without factors, which need few iterations.
  const std::map<std::string, Arguments> solvers{{"ours", {"-prism_factor", "never"}},
                                                 {"paper", {deck_path("paper_solver")}}};
  std::map<std::string, double> iterations;
  std::map<std::string, DrawnFrame> frames;
  for (const auto& [name, deck] : solvers) {
    const CommandResult result = succeed(2, teddy + deck + Arguments{"-output_directory", name, "-prism_ksp_view"});
    EXPECT_EQ(result.errors, "");
    EXPECT_EQ(result.output.find("baij") == std::string::npos, name == "paper") << "matrix-free";
    iterations[name] = read_csv(folder() / name / "history.csv").at("linear_iterations").back();
    frames[name] = last_frame(folder() / name / "teddy.pvd");
  }
  EXPECT_GT(iterations["paper"], 1.5 * iterations["ours"]);
  EXPECT_LT(relative_difference(frames["ours"].points.at("position"), frames["paper"].points.at("position")), 1e-2)
      << "three Newton iterations of either come near the same wall";
}

class OutputInParaViewTest : public ParaViewTest {
 protected:
  void SetUp() override {
    if (!has_paraview()) {
      GTEST_SKIP() << "ParaView or its Python modules are not installed; tools/setup does that";
    }
  }

  /// What ParaView finds in a run, see postproc/check_output.py, when it has written the surface as surface.ply.
  YAML::Node seen_by_paraview(const std::string& pvd) const {
    const std::string check_output = (source_folder / "postproc" / "check_output.py").string();
    const std::string script = write("see.py",
                                     "import runpy, sys\n"
                                     "from paraview.simple import OpenDataFile, SaveData\n"
                                     "SaveData('surface.ply', proxy=OpenDataFile(sys.argv[1]), FileType='Ascii')\n"
                                     "runpy.run_path('" +
                                         check_output + "', run_name='__main__')\n");
    const CommandResult seen = run_command({pvbatch(), script, pvd});
    EXPECT_EQ(seen.exit_code, 0) << seen;
    return YAML::Load(seen.output.substr(seen.output.find("{\"times\"")));
  }
};

/// Expects ParaView's ranges of a field to be those of the files.
void expect_same_ranges(const YAML::Node& ranges, const PointValues& values, const std::string& field) {
  ASSERT_EQ(ranges.size(), values.begin()->second.size()) << field;
  for (std::size_t component = 0; component < ranges.size(); ++component) {
    const auto [low, high] = range_of(values, component);
    EXPECT_NEAR(ranges[component][0].as<double>(), low, 1e-12 * std::abs(low)) << field;
    EXPECT_NEAR(ranges[component][1].as<double>(), high, 1e-12 * std::abs(high)) << field;
  }
}

TEST_F(OutputInParaViewTest, OpensARunOfSeveralObjectsAsNamedBlocks) {
  const Arguments scene{deck_path("two_sheets"),
                        "-objects_paper_mesh_cells",
                        "12,10",
                        "-time_max_steps",
                        "4",
                        "-output_interval_time",
                        "0",
                        "-output_interval_steps",
                        "2"};
  succeed(2, scene + Arguments{"-output_directory", "out"});
  const YAML::Node seen = seen_by_paraview((folder() / "out" / "two_sheets.pvd").string());
  ASSERT_EQ(seen["times"].size(), 3u);
  for (const std::string object : {"paper", "cloth"}) {
    const auto frames = read_pvd(folder() / "out" / "two_sheets.pvd", object);
    ASSERT_EQ(frames.size(), 3u);
    for (std::size_t k = 0; k < frames.size(); ++k) {
      const DrawnFrame frame = read_frame(frames[k].first, frames[k].second);
      const YAML::Node block = seen["frames"][k][object];
      EXPECT_EQ(block["points"].as<std::size_t>(), frame.points.at("position").size()) << object;
      expect_same_ranges(block["fields"]["velocity"], frame.points.at("velocity"), object + "'s velocity");
    }
  }
  succeed(3, scene + Arguments{"-output_directory", "other"});
  const CommandResult same = compare({"out", "other", "--tolerance", "0.1"});
  EXPECT_EQ(same.exit_code, 0) << same;
  EXPECT_NE(same.output.find("position of paper"), std::string::npos) << same;
  EXPECT_NE(same.output.find("velocity of cloth"), std::string::npos) << same;
  succeed(1, scene + Arguments{"-output_directory", "moved", "-objects_cloth_mesh_shift", "1.2,0,0"});
  const CommandResult moved = compare({"out", "moved", "--tolerance", "0.1"});
  EXPECT_EQ(moved.exit_code, 1) << moved;
}

TEST_F(OutputInParaViewTest, OpensARun) {
  succeed(2, {deck_path("hot_ball"), "-mesh_cells", "12,10", "-time_max_steps", "6", "-output_interval_time", "0",
              "-output_interval_steps", "3", "-output_directory", "out", "-heat_sources_ball_centre", "-0.3,0,0"});
  const YAML::Node report = seen_by_paraview("out/hot_ball.pvd");
  ASSERT_EQ(report["times"].size(), 3u);
  ASSERT_EQ(report["frames"].size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(report["times"][i].as<double>(), 0.006 * static_cast<double>(i), 1e-12);
    EXPECT_EQ(report["frames"][i]["points"].as<int>(), 13 * 11 + 12 * 10);
    EXPECT_EQ(report["frames"][i]["cells"].as<int>(), 4 * 12 * 10);
  }
  EXPECT_NE(text_of(folder() / "surface.ply").find("property float u\nproperty float v"), std::string::npos)
      << "with the texture coordinates";
  const DrawnFrame last = last_frame(folder() / "out" / "hot_ball.pvd");
  EXPECT_GT(range_of(last.points.at("temperature")).second, 310) << "the ball heats";
  for (const char* field : {"temperature", "mass_ratio", "velocity"}) {
    expect_same_ranges(report["frames"][2]["fields"][field], last.points.at(field), field);
  }
}

TEST_F(OutputInParaViewTest, ComparesRuns) {
  const auto run = [this](int ranks, const std::string& out, const Arguments& options) {
    succeed(ranks,
            Arguments{deck_path("hot_ball"), "-mesh_cells", "12,10", "-time_max_steps", "4", "-output_interval_time",
                      "0", "-output_interval_steps", "2", "-output_directory", out, "-output_springs",
                      "-heat_sources_ball_centre", "-0.3,0,0", "-elastic_newton_tolerance", "1e-10"} +
                options);
  };
  run(1, "one", {});
  run(2, "two", {});
  run(1, "warmer", {"-heat_diffusivity", "0.00202"});
  run(1, "shorter", {"-time_max_steps", "3"});
  const CommandResult same = compare({"one", "two"});
  EXPECT_EQ(same.exit_code, 0) << same;
  for (const char* field : {"temperature ", "position ", "areal_density ", "target_length (springs) "}) {
    EXPECT_NE(same.output.find(std::string("\n") + field), std::string::npos) << same;
  }
  const CommandResult different = compare({"one", "warmer"});
  EXPECT_EQ(different.exit_code, 1) << different;
  EXPECT_NE(different.output.find("different (tolerance 1e-06)"), std::string::npos) << different;
  EXPECT_EQ(compare({"one", "warmer", "--tolerance", "0.1"}).exit_code, 0);
  EXPECT_NE(compare({"one", "shorter"}).output.find("a frame in "), std::string::npos);
  // What both lack is not equal.
  const auto differ_by = [this](const std::string& words) {
    const CommandResult lacking = compare({"one", "other"});
    EXPECT_EQ(lacking.exit_code, 1) << lacking;
    EXPECT_NE(lacking.output.find(words), std::string::npos) << lacking;
  };
  run(1, "other", {});
  for (const char* out : {"one", "other"}) {
    const std::filesystem::path piece = folder() / out / "hot_ball_000001" / "hot_ball_000001_0.vtp";
    std::filesystem::resize_file(piece, std::filesystem::file_size(piece) / 2);
  }
  differ_by("hot_ball_000001_0.vtp: cut before its end; expected a whole piece of a frame\n");
  for (const char* out : {"one", "other"}) {
    std::filesystem::remove(folder() / out / "hot_ball_000001.pvtp");
  }
  differ_by("hot_ball_000001.pvtp: No such file or directory; expected a frame of the run\n");
  for (const char* out : {"one", "other"}) {
    for (const char* series : {"hot_ball.pvd", "hot_ball_springs.pvd", "hot_ball_bodies.pvd"}) {
      std::ofstream(folder() / out / series) << "<VTKFile type=\"Collection\"><Collection/></VTKFile>";
    }
  }
  differ_by("no frame in either run\n");
}

TEST_F(OutputInParaViewTest, OpensABalloon) {
  succeed(2, {deck_path("inflate_sphere"), "-mesh_level", "3", "-time_max_steps", "10", "-output_interval_steps", "5",
              "-output_directory", "out"});
  const YAML::Node report = seen_by_paraview("out/inflate_sphere.pvd");
  ASSERT_EQ(report["times"].size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(report["times"][i].as<double>(), 0.05 * static_cast<double>(i), 1e-12);
    EXPECT_EQ(report["frames"][i]["points"].as<int>(), 642);
    EXPECT_EQ(report["frames"][i]["cells"].as<int>(), 1280);
  }
  EXPECT_NE(text_of(folder() / "surface.ply").find("element face 1280"), std::string::npos);
  const DrawnFrame last = last_frame(folder() / "out" / "inflate_sphere.pvd");
  EXPECT_GT(range_of(last.cell_values.at("stretch")).first, 1.05) << "it swells";
  expect_same_ranges(report["frames"][2]["fields"]["velocity"], last.points.at("velocity"), "velocity");
  for (const char* field : {"thickness", "thickness_ratio", "stretch", "stress"}) {
    expect_same_ranges(report["frames"][2]["cell_fields"][field], last.cell_values.at(field), field);
  }
}

}  // namespace
}  // namespace pellicle
