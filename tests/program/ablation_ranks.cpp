// A sheet that burns away: the fields do not depend on ranks, partitions and the time of compaction: they stay the
// same.

#include <algorithm>
#include <map>

#include "tests/support/burning_scene.h"
#include "tests/support/frames.h"
#include "tests/support/program.h"
#include "tests/support/tearing_scene.h"

namespace pellicle {
namespace {

class AblationRanksTest : public ProgramTest {
 protected:
  /// Runs a deck. @returns its frames
  std::vector<DrawnFrame> run(int ranks, const std::string& deck, const Arguments& options) {
    const std::string out = "out" + std::to_string(++runs_);
    told_ = succeed(ranks, Arguments{write("scene.yaml", deck), "-output_directory", out, "-output_name", "scene",
                                     "-output_monitor", "1000"} +
                               options)
                .output;
    history_ = read_csv(folder() / out / "history.csv");
    std::vector<DrawnFrame> frames;
    for (const auto& [time, path] : read_pvd(folder() / out / "scene.pvd")) {
      frames.push_back(read_frame(time, path));
    }
    return frames;
  }

  /// How often the last run was compacted.
  int compactions() const {
    int count = 0;
    for (auto at = told_.find("cells are gone"); at != std::string::npos; at = told_.find("cells are gone", at + 1)) {
      ++count;
    }
    return count;
  }

  static void expect_same(const std::vector<DrawnFrame>& a, const std::vector<DrawnFrame>& b, const std::string& what) {
    ASSERT_EQ(a.size(), b.size()) << what;
    for (std::size_t i = 0; i < a.size(); ++i) {
      expect_same_remains(a[i], b[i], agreement, what + ", frame " + std::to_string(i));
    }
  }

  std::map<std::string, std::vector<double>> history_;  ///< of the last run

 private:
  int runs_ = 0;
  std::string told_;
};

/// Points where the sheet is cut.
long cut_points(const DrawnFrame& frame) {
  const PointValues& points = frame.points.at("vertex_id");
  return std::count_if(points.begin(), points.end(), [](const auto& point) { return point.first < 0; });
}

TEST_F(AblationRanksTest, RanksAndTheTimeOfCompaction) {
  const std::vector<DrawnFrame> one =
      run(1, burning_scene, burning_away + Arguments{"-ablation_compact_fraction", "1"});
  EXPECT_EQ(compactions(), 0);
  EXPECT_LT(one.back().points.at("position").size(), 0.8 * (21 * 21 + 20 * 20)) << "a good part is gone";
  EXPECT_GT(cut_points(one.back()), 40);
  EXPECT_GT(range_of(one.back().points.at("position"), 2).second, 0.02) << "the ball lifts the sheet";
  struct Case {
    std::string fraction;
    std::vector<int> ranks;
    int least;  ///< compactions at least
  };
  for (const auto& [fraction, rank_counts, least] :
       std::vector<Case>{{"0.01", {1, 4}, 5}, {"0.1", {2}, 1}, {"1", {3}, 0}}) {
    for (const int ranks : rank_counts) {
      expect_same(one, run(ranks, burning_scene, burning_away + Arguments{"-ablation_compact_fraction", fraction}),
                  std::to_string(ranks) + " ranks, compacted at " + fraction);
      EXPECT_GE(compactions(), least) << fraction;
    }
  }
}

TEST_F(AblationRanksTest, SpreadAnewByOtherPartitioners) {
  const std::vector<DrawnFrame> one = run(1, burning_scene, burning_away);
  const Arguments often = burning_away + Arguments{"-ablation_compact_fraction", "0.02", "-sheet_imbalance_limit", "1"};
  for (const char* partitioner : {"ptscotch", "simple"}) {
    expect_same(one, run(3, burning_scene, often + Arguments{"-sheet_partitioner", partitioner}), partitioner);
    EXPECT_GE(compactions(), 4) << partitioner;
  }
}

TEST_F(AblationRanksTest, RanksThatLoseAllTheirCells) {
  // The fire spreads from one corner of the sheet over nearly all of it.
  const Arguments wide = burning_away + Arguments{"-mesh_cells",
                                                  "10,10",
                                                  "-sheet_thickness",
                                                  "5 cm",
                                                  "-heat_sources_spot_centre",
                                                  "-0.5,-0.5,0",
                                                  "-heat_sources_spot_velocity",
                                                  "0,0,0",
                                                  "-heat_sources_spot_radius",
                                                  "1.3 m",
                                                  "-time_end",
                                                  "100 ms",
                                                  "-output_interval_steps",
                                                  "5",
                                                  "-ablation_compact_fraction",
                                                  "0.05"};
  const std::vector<DrawnFrame> one = run(1, burning_scene, wide + Arguments{"-ablation_compact_fraction", "1"});
  EXPECT_LT(one.back().cells, 4 * 10 * 10 / 5) << "most of it is gone";
  EXPECT_GT(one.back().cells, 0);
  for (const char* limit : {"1", "1e9"}) {
    const std::vector<DrawnFrame> four = run(4, burning_scene, wide + Arguments{"-sheet_imbalance_limit", limit});
    expect_same(one, four, std::string("imbalance limit ") + limit);
    EXPECT_GE(compactions(), 4);
    EXPECT_EQ(four.back().ranks.size() == 4, std::string(limit) == "1")
        << "ranks that keep what they have become empty";
  }
}

TEST_F(AblationRanksTest, HookeSpringsAndTheConsistentHeatOperator) {
  Arguments options = burning_away;
  options.erase(std::find(options.begin(), options.end(), "-project_max_steps"), options.end());  // Its last option.
  options = options + Arguments{"-dynamics",        "spring", "-spring_newton_tolerance", "1e-9",
                                "-spring_ksp_rtol", "1e-12",  "-heat_operator",           "consistent",
                                "-heat_convection", "5"};
  const std::vector<DrawnFrame> one = run(1, burning_scene, options);
  expect_same(one, run(3, burning_scene, options + Arguments{"-ablation_compact_fraction", "0.02"}), "3 ranks");
  EXPECT_GE(compactions(), 4);
}

TEST_F(AblationRanksTest, Tearing) {
  const std::vector<DrawnFrame> one = run(1, tearing_scene, {});
  EXPECT_GT(history_.at("cracked_sides").back(), 8);
  EXPECT_GE(history_.at("pieces").back(), 2) << "it comes apart";
  for (const int ranks : {2, 4}) {
    expect_same(one, run(ranks, tearing_scene, {"-ablation_compact_fraction", "0.01"}),
                std::to_string(ranks) + " ranks");
  }
}

}  // namespace
}  // namespace pellicle
