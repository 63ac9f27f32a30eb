#pragma once

#include "tests/support/frames.h"

namespace pellicle {

/// The checkpoints in the folder of a run, the oldest first.
inline std::vector<std::filesystem::path> checkpoints_of(const std::filesystem::path& out) {
  std::vector<std::filesystem::path> found;
  for (const std::filesystem::directory_entry& entry : std::filesystem::directory_iterator(out)) {
    if (entry.path().extension() == ".h5") {
      found.push_back(entry.path());
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

/// The file of a table: "history.csv", or of an object "history_cloth.csv".
inline std::filesystem::path table_of(const std::filesystem::path& out, const std::string& table,
                                      const std::string& object) {
  return out / (table + (object.empty() ? "" : "_" + object) + ".csv");
}

/// history.csv without times on the wall.
inline std::map<std::string, std::vector<double>> history_of(const std::filesystem::path& out,
                                                             const std::string& object = "") {
  auto history = read_csv(table_of(out, "history", object));
  for (auto column = history.begin(); column != history.end();) {
    column = column->first.compare(0, 8, "seconds_") == 0 ? history.erase(column) : std::next(column);
  }
  return history;
}

/// Expects a row a step from 0 on, with rising times.
inline void expect_whole_table(const std::filesystem::path& out, int steps, const std::string& object = "") {
  const auto history = read_csv(table_of(out, "history", object));
  std::vector<double> expected(static_cast<std::size_t>(steps) + 1);
  std::iota(expected.begin(), expected.end(), 0);
  EXPECT_EQ(history.at("step"), expected) << out;
  const std::vector<double>& times = history.at("time");
  EXPECT_TRUE(std::adjacent_find(times.begin(), times.end(), std::greater_equal<>()) == times.end()) << out;
}

/// Expects that the tables have no gap and no row twice, that the frames have rising times up to the last step's and
/// that each can be read, that nothing unfinished is left, and that every file is listed.
inline void expect_whole_output(const std::filesystem::path& out, const std::string& name, int steps,
                                const std::string& object = "") {
  expect_whole_table(out, steps, object);
  const auto frames = read_pvd(out / (name + ".pvd"), object);
  for (std::size_t k = 1; k < frames.size(); ++k) {
    EXPECT_LT(frames[k - 1].first, frames[k].first) << out;
  }
  for (const auto& [time, path] : frames) {
    EXPECT_GT(read_pvtp(path)->GetNumberOfPoints(), 0) << path;
  }
  EXPECT_DOUBLE_EQ(frames.back().first, history_of(out, object).at("time").back());
  if (std::filesystem::exists(table_of(out, "pieces", object))) {
    const auto pieces = read_csv(table_of(out, "pieces", object));
    std::set<std::pair<double, double>> rows;
    std::set<double> times;
    for (std::size_t k = 0; k < pieces.at("time").size(); ++k) {
      EXPECT_TRUE(rows.emplace(pieces.at("time")[k], pieces.at("piece")[k]).second) << out << ": a piece twice";
      times.insert(pieces.at("time")[k]);
    }
    EXPECT_EQ(times.size(), frames.size()) << out << ": the pieces of each frame";
  }
  EXPECT_FALSE(std::filesystem::exists(out / "run.part"));
  std::ifstream file(out / "run_files.txt");
  const std::string listed((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  for (const std::filesystem::directory_entry& entry : std::filesystem::recursive_directory_iterator(out)) {
    const std::string written = std::filesystem::relative(entry.path(), out).string();
    if (entry.is_regular_file() && written != "run_files.txt") {
      EXPECT_NE(listed.find(" " + written + "\n"), std::string::npos) << out << ": " << written << " is not listed";
    }
  }
}

/// Expects that the frames of two runs agree, see expect_same_remains and expect_same_balloon.
template <class ExpectSame>
void expect_same_frames(const std::filesystem::path& one, const std::filesystem::path& other, const std::string& name,
                        const ExpectSame& expect_same, const std::string& object = "") {
  const auto a = read_pvd(one / (name + ".pvd"), object);
  const auto b = read_pvd(other / (name + ".pvd"), object);
  ASSERT_EQ(a.size(), b.size()) << other;
  for (std::size_t k = 0; k < a.size(); ++k) {
    EXPECT_DOUBLE_EQ(a[k].first, b[k].first) << other;
    expect_same(read_frame(a[k].first, a[k].second), read_frame(b[k].first, b[k].second), agreement,
                other.string() + ", frame " + std::to_string(k));
  }
}

/// Expects that the tables of two runs agree in what they know of the state: not in iterations, which belong to the
/// solvers, nor in errors, of which only the size counts.
inline void expect_same_history(const std::filesystem::path& one, const std::filesystem::path& other,
                                const std::string& object = "") {
  const auto a = history_of(one, object);
  const auto b = history_of(other, object);
  for (const char* name : {"mass_left", "mass_burnt", "pieces", "heat_content", "heat_in", "kinetic_energy",
                           "gas_volume_ball", "gas_pressure_dome", "time"}) {
    if (a.count(name) == 0) {
      continue;
    }
    const std::vector<double>& x = a.at(name);
    const std::vector<double>& y = b.at(name);
    ASSERT_EQ(x.size(), y.size()) << other;
    double scale = 0;
    for (const double value : x) {
      scale = std::max(scale, std::abs(value));
    }
    for (std::size_t row = 0; row < x.size(); ++row) {
      EXPECT_NEAR(x[row], y[row], agreement * scale) << other << ": " << name << " in row " << row;
    }
  }
}

}  // namespace pellicle
