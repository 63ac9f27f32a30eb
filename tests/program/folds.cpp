// What postproc/folds.py says of surfaces whose folds are known, and of scenes.

#include <cmath>
#include <cstdio>
#include <functional>
#include <regex>
#include <sstream>
#include <string>
#include <utility>

#include "tests/support/program.h"

namespace pellicle {
namespace {

class FoldsTest : public ProgramTest {
 protected:
  /// A number that the script prints of the last frame of a run.
  double measure(const std::string& pvd, const std::string& name) const {
    const CommandResult result = run_command(
        {"/usr/bin/python3", PELLICLE_SOURCE_DIR "/postproc/folds.py", (folder() / pvd).string(), "--json"});
    EXPECT_EQ(result.exit_code, 0) << result;
    std::smatch found;
    EXPECT_TRUE(std::regex_search(result.output, found, std::regex("\"" + name + "\": ([-+.e0-9]+)"))) << result;
    return found.empty() ? -1 : std::stod(found[1]);
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

/// Folds of the mesh, from cell to cell, are at most so large a share of the sharp folds of an elastic sheet.
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
                                         "sheet_weights_d", "half_burns", "curtain", "roof", "shirt", "burning_torus"),
                         [](const auto& deck) { return std::string(deck.param); });

}  // namespace
}  // namespace pellicle
