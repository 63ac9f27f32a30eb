// What postproc/folds.py says of surfaces whose folds are known, and of scenes.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numeric>
#include <regex>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/csv.h"
#include "tests/support/program.h"

namespace pellicle {
namespace {

class FoldsTest : public ProgramTest {
 protected:
  /// A number that the script prints of the last frame of a run.
  double measure(const std::string& pvd, const std::string& name) const { return measures(pvd, name).at(0); }

  /// One number, or several in brackets. @param frame -1: the last
  std::vector<double> measures(const std::string& pvd, const std::string& name, int frame = -1) const {
    const CommandResult result = run_command({"/usr/bin/python3", PELLICLE_SOURCE_DIR "/postproc/folds.py",
                                              (folder() / pvd).string(), "--json", "--frame=" + std::to_string(frame)});
    EXPECT_EQ(result.exit_code, 0) << result;
    std::smatch found;
    const std::regex expression("\"" + name + "\": ([-+.e0-9]+|\\[[^\\]]*\\])");
    EXPECT_TRUE(std::regex_search(result.output, found, expression)) << result;
    std::string text = found.empty() ? "nan" : found[1].str();
    std::replace_if(
        text.begin(), text.end(), [](char c) { return c == '[' || c == ']' || c == ','; }, ' ');
    std::istringstream words(text);
    std::vector<double> values;
    for (std::string word; words >> word;) {
      values.push_back(std::stod(word));
    }
    return values;
  }

  /// A surface of 16 x 6 cells, drawn as it was made. @param profile place (x, z) of row i [m]
  void draw(const std::string& name, int ranks, const std::function<std::pair<double, double>(int)>& profile) const {
    constexpr int rows = 16;
    constexpr int columns = 6;
    std::ostringstream mesh;
    for (int i = 0; i <= rows; ++i) {
      for (int j = 0; j <= columns; ++j) {
        const auto [x, z] = profile(i);
        mesh << "v " << x << " " << 0.1 * j << " " << z << "\n";
      }
    }
    for (int i = 0; i < rows; ++i) {
      for (int j = 1; j <= columns; ++j) {
        const int first = i * (columns + 1) + j;
        mesh << "f " << first << " " << first + columns + 1 << " " << first + columns + 2 << " " << first + 1 << "\n";
      }
    }
    succeed(ranks, {"-mesh_file", write(name + ".obj", mesh.str()), "-time_end", "0", "-output_name", name,
                    "-output_directory", name});
  }

  /// Of `fold` in every nth row, root mean square over all folds of the surface.
  static double rms(double fold, double folded_rows) {
    constexpr double all = 15 * 6 + 16 * 5;
    return fold * std::sqrt(folded_rows * 6 / all);
  }
};

constexpr double pi = 3.14159265358979;

TEST_F(FoldsTest, OfACylinder) {
  for (const int ranks : {1, 3}) {
    const std::string name = "cylinder" + std::to_string(ranks);
    draw(name, ranks, [](int i) { return std::pair(std::sin(i * pi / 10), std::cos(i * pi / 10)); });
    EXPECT_NEAR(measure(name + "/" + name + ".pvd", "rms_fold"), rms(18, 15), 1e-3);
    EXPECT_EQ(measure(name + "/" + name + ".pvd", "stitch"), 0);
    EXPECT_EQ(measure(name + "/" + name + ".pvd", "pairs"), 14 * 6) << "of 18 degrees each";
    EXPECT_EQ(measure(name + "/" + name + ".pvd", "cells"), 16 * 6);
  }
}

TEST_F(FoldsTest, OfPleats) {
  const double slope = std::tan(pi / 12);  // 15 degrees, so folds of 30
  draw("pleats", 2, [=](int i) { return std::pair(0.1 * i, 0.1 * slope * (i % 2)); });
  EXPECT_NEAR(measure("pleats/pleats.pvd", "stitch"), 1, 1e-4);
  EXPECT_NEAR(measure("pleats/pleats.pvd", "rms_fold"), rms(30, 15), 1e-3);
  draw("wider", 1, [=](int i) { return std::pair(0.1 * i, 0.1 * slope * std::abs((i + 2) % 4 - 2)); });
  EXPECT_NEAR(measure("wider/wider.pvd", "stitch"), 0, 1e-6) << "pleats of two cells";
  EXPECT_NEAR(measure("wider/wider.pvd", "rms_fold"), rms(30, 7), 1e-3);
  draw("shallow", 1, [](int i) { return std::pair(0.1 * i, 0.005 * (i % 2)); });
  EXPECT_EQ(measure("shallow/shallow.pvd", "pairs"), 0) << "folds of less than 10 degrees do not count";
  EXPECT_EQ(measure("shallow/shallow.pvd", "stitch"), 0);
}

TEST_F(FoldsTest, CutCellsAreLeftOut) {
  succeed(1, {deck_path("hot_sphere_a"), "-mesh_cells", "20,20", "-output_interval_time", "10", "-time_end", "0.3",
              "-output_directory", "out"});
  const double cells = measure("out/hot_sphere_a.pvd", "cells");
  EXPECT_GT(cells, 100);
  EXPECT_LT(cells, 400);
}

/// Folds of the mesh, from cell to cell, are at most so large a fraction of the sharp folds of an elastic sheet.
constexpr double most_stitches = 0.05;

TEST_F(FoldsTest, ASheetThatShrinksFoldsWithoutStitches) {
  // Bending stiffness makes the wrinkles as many cells wide as in the deck, on fewer cells.
  succeed(1, {deck_path("hot_sphere_b"), "-mesh_cells", "40,40", "-sheet_bending_stiffness", "1e-2", "-time_end", "0.8",
              "-output_interval_time", "10", "-output_directory", "out"});
  EXPECT_GT(measure("out/hot_sphere_b.pvd", "pairs"), 50);
  EXPECT_LE(measure("out/hot_sphere_b.pvd", "stitch"), most_stitches);
}

class LongFolds : public FoldsTest, public testing::WithParamInterface<const char*> {};

TEST_P(LongFolds, OfADeckAreNoStitches) {
  const std::string deck = GetParam();
  set_time_limit(1500);
  succeed(2, {deck_path(deck), "-output_interval_time", "10", "-output_directory", "out"});
  const double stitch = measure("out/" + deck + ".pvd", "stitch");
  std::printf("%s: stitch %.4f, rms fold %.3f degrees\n", deck.c_str(), stitch,
              measure("out/" + deck + ".pvd", "rms_fold"));
  EXPECT_LE(stitch, most_stitches);
}

INSTANTIATE_TEST_SUITE_P(Decks, LongFolds,
                         testing::Values("burning_paper", "hot_ball", "hot_sphere_a", "hot_sphere_b", "hot_sphere_c",
                                         "hot_sphere_d", "sheet_weights_a", "sheet_weights_b", "sheet_weights_c",
                                         "sheet_weights_d", "half_burns", "curtain", "roof", "shirt", "burning_torus",
                                         "paper_lantern", "burning_lantern", "uniform_shrink", "torus_on_sphere",
                                         "tearing_paper"),
                         [](const auto& deck) { return std::string(deck.param); });

class LongCrumpling : public FoldsTest {
 protected:
  /// Means over what happens from 0.4 s on.
  struct Statistics {
    double bend = 0;    ///< rms_bend [1/m]
    double size = 0;    ///< diagonal of the extents [m]
    double strain = 0;  ///< mean strain of the springs
  };

  Statistics crumple(const std::string& cells, const std::string& step) const {
    const std::string out = cells + "_" + step;
    succeed(2,
            {deck_path("crumpling"), "-mesh_cells", cells + "," + cells, "-time_step", step, "-output_directory", out});
    Statistics mean;
    constexpr int first = 8;  // of the frames, 50 ms apart
    constexpr int last = 16;
    for (int frame = first; frame <= last; ++frame) {
      const std::vector<double> extents = measures(out + "/crumpling.pvd", "extents", frame);
      mean.bend += measures(out + "/crumpling.pvd", "rms_bend", frame).at(0) / (last - first + 1);
      mean.size += std::hypot(extents.at(0), extents.at(1), extents.at(2)) / (last - first + 1);
    }
    const auto history = read_csv(folder() / out / "history.csv");
    const std::vector<double>& time = history.at("time");
    const auto begin = std::lower_bound(time.begin(), time.end(), 0.4 - 1e-9) - time.begin();
    const std::vector<double>& strain = history.at("mean_strain");
    mean.strain = std::accumulate(strain.begin() + begin, strain.end(), 0.0) /
                  static_cast<double>(strain.size() - static_cast<std::size_t>(begin));
    std::printf("%s x %s cells, step %s s: rms_bend %.4f 1/m, size %.4f m, mean strain %.3f %%\n", cells.c_str(),
                cells.c_str(), step.c_str(), mean.bend, mean.size, 100 * mean.strain);
    return mean;
  }
};

/// Expects that a number changes less by the second halving than by the first.
void expect_settles(const std::array<double, 3>& of, const char* name) {
  EXPECT_LT(std::abs(of[2] - of[1]), std::abs(of[1] - of[0]))
      << name << ": " << of[0] << ", " << of[1] << ", " << of[2];
}

// On 20 x 20 cells the wrinkles are only a few cells wide: rms_bend begins to settle at 40 x 40, size and strain
// before.
TEST_F(LongCrumpling, SettlesAsMeshAndStepAreHalved) {
  set_time_limit(1500);
  const Statistics base = crumple("40", "2e-3");
  const Statistics fine = crumple("80", "2e-3");
  const Statistics finest = crumple("160", "2e-3");
  expect_settles({base.bend, fine.bend, finest.bend}, "rms_bend on finer meshes");
  expect_settles({base.size, fine.size, finest.size}, "size on finer meshes");
  expect_settles({base.strain, fine.strain, finest.strain}, "mean strain on finer meshes");
  const Statistics short_step = crumple("40", "1e-3");
  const Statistics shortest_step = crumple("40", "5e-4");
  expect_settles({base.bend, short_step.bend, shortest_step.bend}, "rms_bend with shorter steps");
  expect_settles({base.size, short_step.size, shortest_step.size}, "size with shorter steps");
  expect_settles({base.strain, short_step.strain, shortest_step.strain}, "mean strain with shorter steps");
  // What is left of a halving: strain settles last on meshes, size is settled from coarse meshes and long steps on.
  const Statistics coarse = crumple("20", "2e-3");
  const Statistics long_step = crumple("40", "4e-3");
  EXPECT_NEAR(fine.strain, base.strain, 0.05 * base.strain);
  EXPECT_NEAR(finest.strain, fine.strain, 0.02 * fine.strain);
  EXPECT_NEAR(coarse.size, base.size, 0.005 * base.size);
  EXPECT_NEAR(long_step.size, base.size, 0.005 * base.size);
  EXPECT_NEAR(short_step.size, base.size, 0.005 * base.size);
}

}  // namespace
}  // namespace pellicle
