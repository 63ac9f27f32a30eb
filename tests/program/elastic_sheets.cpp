// Sheets as a material, against formulas.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "base/units.h"
#include "tests/support/csv.h"
#include "tests/support/frames.h"
#include "tests/support/program.h"

namespace pellicle {
namespace {

class ElasticSheets : public ProgramTest {
 protected:
  /// How far the tip of input/cantilever.yaml has dropped when it is at rest [m].
  double drop(const std::string& stiffness, const std::string& cells, const std::string& step,
              const std::string& size = "1,0.2") const {
    succeed(1, {deck_path("cantilever"), "-sheet_bending_stiffness", stiffness, "-mesh_cells", cells, "-mesh_size",
                size, "-time_step", step, "-output_interval_time", "10", "-output_directory", "out"});
    const DrawnFrame frame = last_frame(folder() / "out" / "cantilever.pvd");
    double lowest = 0;
    for (const auto& [id, place] : frame.points.at("position")) {
      lowest = std::min(lowest, place[2]);
    }
    return -lowest;
  }
};

/// Tip drops of the heavy elastica of 1 m, 9.81 N/m^2, by bending stiffness.
const std::pair<const char*, double> elastica[] = {{"10", 0.1212}, {"1", 0.6954}, {"0.1", 0.9369}};

TEST_F(ElasticSheets, ACantileverDropsAsTheElastica) {
  for (const auto& [stiffness, exact] : elastica) {
    const double wide = drop(stiffness, "20,4", "4e-3");
    EXPECT_NEAR(wide, exact, 0.06 * exact) << stiffness;
    EXPECT_NEAR(drop(stiffness, "20,4", "8e-3"), wide, 1e-3 * wide)
        << stiffness << ", the step does not matter at rest";
    EXPECT_NEAR(drop(stiffness, "20,1", "4e-3", "1,0.05"), exact, 0.06 * exact) << stiffness << ", of one cell's width";
  }
}

class LongElasticSheets : public ElasticSheets, public ::testing::WithParamInterface<std::pair<const char*, double>> {};

TEST_P(LongElasticSheets, ACantileverDropsAlikeOnEveryMeshAndWithEveryStep) {
  set_time_limit(1500);
  const auto& [stiffness, exact] = GetParam();
  for (const char* cells : {"40,8", "80,16"}) {
    for (const char* step : {"4e-3", "2e-3", "1e-3"}) {
      const double found = drop(stiffness, cells, step);
      std::printf("D %s N m, %s cells, step %s s: %.4f m, elastica %.4f m\n", stiffness, cells, step, found, exact);
      EXPECT_NEAR(found, exact, 0.03 * exact) << stiffness << ", " << cells << ", " << step;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(BendingStiffness, LongElasticSheets, ::testing::ValuesIn(elastica));

TEST_F(ElasticSheets, ACantileverSwingsWithItsFirstFrequency) {
  // About its small static drop, without damping but that of implicit Euler.
  succeed(1, {deck_path("cantilever"), "-force_gravity", "0,0,-0.01", "-force_damping", "0", "-sheet_damping", "0",
              "-mesh_cells", "20,4", "-time_step", "2e-3", "-time_end", "2", "-output_interval_time", "10",
              "-output_directory", "out"});
  const auto history = read_csv(folder() / "out" / "history.csv");
  const std::vector<double> time = history.at("time");
  const std::vector<double> momentum = history.at("momentum_z");
  std::vector<double> turns;  // at half periods
  for (std::size_t k = 2; k < time.size(); ++k) {
    if (momentum[k - 1] * momentum[k] < 0) {
      turns.push_back(time[k - 1] + (time[k] - time[k - 1]) * momentum[k - 1] / (momentum[k - 1] - momentum[k]));
    }
  }
  ASSERT_GE(turns.size(), 2u);
  const double period = 2 * std::acos(-1.0) / (1.8751 * 1.8751);  // D = 1 N m, 1 kg/m^2, 1 m
  EXPECT_NEAR(turns[1], period, 0.03 * period);
}

TEST_F(ElasticSheets, StepsFollowFromTheirError) {
  // In free fall a step of implicit Euler goes g h^2/2 too far, so it becomes 0.9 of the length with the error aimed
  // at.
  const std::string deck = write("fall.yaml",
                                 "mesh: {cells: [8, 2], size: [0.8 m, 0.2 m]}\n"
                                 "sheet: {perturbation: 0}\n"
                                 "force: {gravity: [0, 0, -9.81], damping: 0}\n"
                                 "time: {step: 1 ms, end: 0.3 s}\n"
                                 "output: {directory: out, interval_time: 0.2 s}\n");
  for (const double tolerance : {1e-3, 1e-5}) {
    succeed(3, {deck, "-time_tolerance", number_text(tolerance), "-time_max_step", "1"});
    const auto history = read_csv(folder() / "out" / "history.csv");
    const std::vector<double>& steps = history.at("time_step");
    const double exact = 0.9 * std::sqrt(2 * tolerance * 0.4 / 9.81);
    ASSERT_GT(steps.size(), 10U);
    EXPECT_NEAR(steps[8], exact, 1e-6 * exact);
    double error = 0;
    for (const double h : steps) {
      error += 9.81 * h * h / 2;
    }
    const DrawnFrame frame = last_frame(folder() / "out" / "fall.pvd");
    for (const auto& [id, place] : frame.points.at("position")) {
      EXPECT_NEAR(place[2], -9.81 * 0.3 * 0.3 / 2 - error, 1e-7);
    }
  }
}

}  // namespace
}  // namespace pellicle
