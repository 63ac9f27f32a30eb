// What a run leaves behind: frames for ParaView, the history, and what it prints.

#include <array>
#include <cmath>
#include <set>
#include <sstream>

#include "tests/support/burning_scene.h"
#include "tests/support/frames.h"
#include "tests/support/program.h"

namespace pellicle {
namespace {

class OutputTest : public ProgramTest {
 protected:
  CommandResult run(int ranks, const Arguments& options) {
    return succeed(ranks, Arguments{write("scene.yaml", burning_scene)} + options);
  }
  std::filesystem::path pvd() const { return folder() / "out" / "scene.pvd"; }
  std::vector<double> times() const {
    std::vector<double> times;
    for (const auto& frame : read_pvd(pvd())) {
      times.push_back(frame.first);
    }
    return times;
  }
  /// Expects times in order, to rounding.
  void expect_times(const std::vector<double>& expected) const {
    const std::vector<double> found = times();
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
      EXPECT_NEAR(found[i], expected[i], 1e-12) << i;
    }
  }
};

TEST_F(OutputTest, FramesEverySoManySteps) {
  run(2, {"-time_max_steps", "8", "-output_interval_steps", "3"});
  expect_times({0, 0.006, 0.012, 0.016});
}

TEST_F(OutputTest, FramesEverySoMuchTime) {
  run(1, {"-time_max_steps", "10", "-output_interval_time", "5 ms"});
  // The first step at or after each multiple of 5 ms, of steps of 2 ms.
  expect_times({0, 0.006, 0.010, 0.016, 0.020});
}

TEST_F(OutputTest, TheRunEndsAtItsTime) {
  run(1, {"-time_step", "3 ms", "-time_end", "10 ms", "-output_interval_steps", "1"});
  expect_times({0, 0.003, 0.006, 0.008, 0.010});  // The last two steps share what is left.
  const auto history = read_csv(folder() / "out" / "history.csv");
  EXPECT_NEAR(history.at("time_step").back(), 0.002, 1e-12);
}

TEST_F(OutputTest, AFrameHasThePointsAndFieldsOfTheSheet) {
  run(3, {"-time_max_steps", "4"});
  for (const auto& [time, path] : read_pvd(pvd())) {
    const DrawnFrame frame = read_frame(time, path);
    EXPECT_EQ(frame.points.at("position").size(), 21u * 21 + 20 * 20) << "corners and centres, each once";
    EXPECT_EQ(frame.cells, 4 * 20 * 20);
    EXPECT_EQ(frame.ranks, (std::set<int>{0, 1, 2}));
    for (const char* field : {"temperature", "mass_ratio", "velocity", "strain", "vertex_id"}) {
      EXPECT_EQ(frame.point_fields.count(field), 1u) << field;
    }
    EXPECT_EQ(frame.points.at("velocity").begin()->second.size(), 3u);
  }
  const DrawnFrame first = read_frame(0, read_pvd(pvd()).front().second);
  // Row by row: vertex 20 is the end of the first row, (0.5, -0.5), moved by at most the perturbation of 1 % of a cell.
  EXPECT_NEAR(first.points.at("position").at(20)[0], 0.5, 1e-3);
  EXPECT_NEAR(first.points.at("position").at(20)[1], -0.5, 1e-3);
  EXPECT_EQ(range_of(first.points.at("vertex_id")).first, 0);
  EXPECT_EQ(range_of(first.points.at("vertex_id")).second, 21 * 21 + 20 * 20 - 1);
  EXPECT_EQ(range_of(first.points.at("temperature")), (std::pair<double, double>{300, 300}));
  EXPECT_EQ(range_of(first.points.at("mass_ratio")), (std::pair<double, double>{1, 1}));
}

TEST_F(OutputTest, FieldsCanBeChosen) {
  run(2, {"-time_max_steps", "1", "-output_fields", "temperature"});
  const DrawnFrame frame = last_frame(pvd());
  EXPECT_EQ(frame.point_fields.count("temperature"), 1u);
  EXPECT_EQ(frame.point_fields.count("vertex_id"), 1u);
  EXPECT_EQ(frame.point_fields.count("mass_ratio"), 0u);
  EXPECT_EQ(frame.point_fields.count("velocity"), 0u);
}

TEST_F(OutputTest, SpringsAsLines) {
  run(2, {"-time_max_steps", "1", "-output_springs"});
  const auto frames = read_pvd(folder() / "out" / "scene_springs.pvd");
  ASSERT_EQ(frames.size(), 2u);
  const auto lines = read_pvtp(frames.back().second);
  // Of n x n cells: red from each lattice point to the corners, green between lattice points, blue between corners,
  // yellow diagonals of the cells.
  const int n = 20;
  const std::array<long, 4> expected{4 * n * n, 2 * n * (n - 1), 2 * n * (n + 1), 2 * n * n};
  std::array<long, 4> found{};
  vtkDataArray* colour = lines->GetCellData()->GetArray("colour");
  ASSERT_NE(colour, nullptr);
  for (const char* field : {"strain", "target_length", "state"}) {
    EXPECT_NE(lines->GetCellData()->GetArray(field), nullptr) << field;
  }
  for (vtkIdType cell = 0; cell < lines->GetNumberOfCells(); ++cell) {
    ++found.at(static_cast<std::size_t>(colour->GetTuple1(cell)));
  }
  EXPECT_EQ(found, expected);
}

TEST_F(OutputTest, HistoryHasTheBalances) {
  run(2, {});
  const auto history = read_csv(folder() / "out" / "history.csv");
  for (const char* name : {"time", "step", "mass_left", "mass_burnt", "heat_content", "kinetic_energy"}) {
    ASSERT_EQ(history.count(name), 1u) << name;
    EXPECT_EQ(history.at(name).size(), 21u) << name;
  }
  const std::string head = text_of(folder() / "out" / "history.csv");
  EXPECT_EQ(head.find("time [s],step"), 0u) << "units stand in brackets";
  for (std::size_t row = 0; row < 21; ++row) {
    EXPECT_EQ(history.at("step")[row], row);
    EXPECT_NEAR(history.at("time")[row], 0.002 * static_cast<double>(row), 1e-12);
    EXPECT_NEAR(history.at("mass_left")[row] + history.at("mass_burnt")[row], 1, 1e-12) << "1 m^2 of 1 kg/m^2";
    // The default operator conserves: what came in and has not left is there.
    EXPECT_NEAR(history.at("heat_content")[row],
                history.at("heat_content")[0] + history.at("heat_in")[row] - history.at("heat_out")[row],
                1e-9 * history.at("heat_in")[row])
        << row;
    EXPECT_LE(std::abs(history.at("heat_made")[row]), 1e-9 * history.at("heat_in")[row]) << row;
  }
  EXPECT_GT(history.at("mass_burnt").back(), 0.01);
  EXPECT_GT(history.at("kinetic_energy").back(), 0);
}

TEST_F(OutputTest, ALogHasMeshAndEndAndMoreOnRequest) {
  const CommandResult quiet = run(2, {"-time_max_steps", "4"});
  EXPECT_EQ(std::count(quiet.output.begin(), quiet.output.end(), '\n'), 4) << quiet;
  for (const char* text : {"rectangle: 441 points", "400 quads", "open, 80 boundary edges",
                           "\nlargest strain of the net: ", "\ndone: time 0.008 s, 4 steps in ", "; out/scene.pvd\n",
                           "\ncheckpoint: out/checkpoint_000004.h5; to go on: "}) {
    EXPECT_NE(quiet.output.find(text), std::string::npos) << text << "\n" << quiet;
  }
  EXPECT_EQ(quiet.errors, "");
  const CommandResult told = run(2, {"-time_max_steps", "4", "-output_monitor", "2"});
  EXPECT_EQ(told.errors, "");
  for (const char* text :
       {"441", "400", "ranks: 2", "edge cut", "imbalance", "springs:", "red", "projection", "total"}) {
    EXPECT_NE(told.output.find(text), std::string::npos) << text << "\n" << told;
  }
  std::istringstream lines(told.output);
  int progress = 0;
  for (std::string line; std::getline(lines, line);) {
    progress += line.rfind("step ", 0) == 0 ? 1 : 0;
  }
  EXPECT_EQ(progress, 2) << told;
}

TEST_F(OutputTest, ProjectionMonitor) {
  const CommandResult told = run(2, {"-time_max_steps", "2", "-project_monitor", "-project_max_steps", "3"});
  const auto csv = read_csv(folder() / "out" / "projection.csv");
  // The start and four colours in each of three projection steps, in each of two time steps.
  const std::size_t rows = 2 * (1 + 3 * 4);
  ASSERT_EQ(csv.at("error_total").size(), rows);
  for (std::size_t row = 0; row < rows; ++row) {
    double squares = 0;
    for (const char* colour : {"error_red", "error_green", "error_blue", "error_yellow"}) {
      squares += std::pow(csv.at(colour)[row], 2);
    }
    EXPECT_NEAR(std::sqrt(squares), csv.at("error_total")[row], 1e-12);
  }
  EXPECT_LT(csv.at("error_total")[12], csv.at("error_total")[0]) << "the first step begins with the perturbation";
  std::istringstream lines(told.output);
  std::size_t printed = 0;
  for (std::string line; std::getline(lines, line);) {
    printed += line.find("||C||") != std::string::npos ? 1 : 0;
  }
  EXPECT_EQ(printed, rows) << told;
}

TEST_F(OutputTest, AFailedRunKeepsTheLastGoodState) {
  // At 10 ms an absurdly hot fire breaks out: everything shrinks to a tenth at once.
  const CommandResult result = pellicle(
      2, {write("scene.yaml", burning_scene), "-heat_sources_spot_start_time", "9 ms", "-heat_sources_spot_rate", "1e9",
          "-heat_sources_spot_temperature", "1e7", "-combustion_min_mass", "1e-3", "-combustion_initial_density", "1",
          "-combustion_burnt_density", "1", "-output_interval_steps", "100", "-time_max_retries", "2"});
  EXPECT_EQ(result.exit_code, 1) << result;
  const std::vector<std::string> lines = result.error_lines();
  ASSERT_EQ(lines.size(), 1u) << result;
  for (const char* text : {"pellicle: step 6 at time 0.01", "failed", "last frame"}) {
    EXPECT_NE(lines[0].find(text), std::string::npos) << text << " is not in: " << lines[0];
  }
  expect_times({0, 0.010});
  const DrawnFrame frame = last_frame(pvd());
  EXPECT_EQ(frame.points.at("position").size(), 21u * 21 + 20 * 20);
  EXPECT_LT(range_of(frame.points.at("temperature")).second, 301) << "the state before the fire";
  EXPECT_NE(lines[0].find("; the state in which it failed is out/scene_failed.pvd"), std::string::npos) << lines[0];
  const std::filesystem::path failed = folder() / "out/scene_failed.pvd";
  ASSERT_EQ(read_pvd(failed).size(), 1U);
  EXPECT_NEAR(read_pvd(failed)[0].first, 0.0105, 1e-12) << "where the last try was to end";
  EXPECT_GT(range_of(last_frame(failed).points.at("temperature")).second, 1000) << "in the fire";
  const auto history = read_csv(folder() / "out" / "history.csv");
  EXPECT_EQ(history.at("step").back(), 5);
  EXPECT_NEAR(read_csv(folder() / "out/pieces.csv").at("time").back(), 0.010, 1e-12) << "of the frames of the run";
  run(2, {"-time_max_steps", "4"});
  EXPECT_FALSE(std::filesystem::exists(failed)) << "it is of the run before";
}

// Of OpenMPI's, for what ranks share: runs at the same time would remove it from under each other.
TEST_F(OutputTest, ARunWithoutMpirunNeedsNoFolderBesidesItsOwn) {
  setenv("OMPI_MCA_orte_tmpdir_base", write("no_folder", "").c_str(), 1);
  const CommandResult result = run(1, {"-time_max_steps", "2", "-checkpoint_interval_steps", "1"});
  EXPECT_EQ(result.errors, "");
  EXPECT_TRUE(std::filesystem::exists(folder() / "out/checkpoint_000002.h5"));
}

TEST_F(OutputTest, AnOlderRunOfTheSameNameIsReplaced) {
  run(2, {"-time_max_steps", "4", "-output_interval_steps", "1"});
  run(1, {"-time_max_steps", "2", "-output_interval_steps", "1"});
  expect_times({0, 0.002, 0.004});
  int drawn = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder() / "out")) {
    drawn += entry.path().extension() == ".pvtp" ? 1 : 0;
  }
  EXPECT_EQ(drawn, 3 * 3) << "sheet, body and ball of heat: no frame of the older run is left";
}

}  // namespace
}  // namespace pellicle
