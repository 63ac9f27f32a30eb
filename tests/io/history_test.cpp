#include "io/history.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cmath>
#include <csignal>
#include <cstdlib>

#include "tests/io/files.h"

namespace pellicle {
namespace {

class HistoryTest : public testing::Test {
 protected:
  HistoryTest() : output_(MPI_COMM_WORLD, options(), record_) { output_.start(); }

  std::string in_folder(const std::string& name) const { return folder_ / ("out/" + name); }
  std::string text() const { return file_text(in_folder("history.csv")); }
  const TestFolder& folder() const { return folder_; }
  OutputFolder& output() { return output_; }

 private:
  OutputOptions options() const {
    OutputOptions options;
    options.directory = folder_ / "out";
    options.name = "run";
    return options;
  }

  TestFolder folder_;
  RunRecord record_;
  OutputFolder output_;
};

TEST_F(HistoryTest, WritesNamesUnitsAndAllDigits) {
  History history(output(), "history.csv", {{"time", "s"}, {"step", ""}, {"mass_left", "kg"}});
  const double third = 1.0 / 3;
  history.add({0.1, 1, third});
  history.add({0.2, 2, 0});
  EXPECT_EQ(error_text([&] {
              history.add({0.3, 3, std::nan("")});
            }),
            "history.csv: mass_left is nan, expected a finite number: some option is beyond what can be computed with");
  MPI_Barrier(MPI_COMM_WORLD);
  // Read while the file is still open: every row has reached it.
  const std::string all = text();
  EXPECT_EQ(all.substr(0, all.find('\n')), "time [s],step,mass_left [kg]");
  const std::string first = all.substr(all.find('\n') + 1);
  EXPECT_EQ(first, "0.10000000000000001,1,0.33333333333333331\n0.20000000000000001,2,0\n");
  EXPECT_EQ(std::strtod(first.c_str() + first.find(",1,") + 3, nullptr), third);
  EXPECT_THROW(history.add({1}), std::logic_error);
}

TEST_F(HistoryTest, RefusesColumnsAndTablesOfOneName) {
  EXPECT_EQ(
      error_text([&] {
        History(output(), "a.csv", {{"time", "s"}, {"gap_b", "m", "bodies.b"}, {"gap_b", ""}});
      }),
      "bodies.b and the program itself both name the column gap_b of a.csv; expected another name of one of them");
  EXPECT_EQ(
      error_text([&] {
        History(output(), "b.csv", {{"gap_b", "m", "bodies.b"}, {"gap_B", "m", "bodies.B"}});
      }),
      "bodies.b and bodies.B both name the column gap_B (or gap_b, which differs by upper and lower case alone) of "
      "b.csv; expected another name of one of them");
  EXPECT_EQ(
      error_text([&] {
        History(output(), "A.csv", {{"time", "s"}}, "objects.A");
      }),
      "the program itself and objects.A both name the file A.csv (or a.csv, which differs by upper and lower case "
      "alone); expected another name of one of them");
}

TEST_F(HistoryTest, OnAFullDiskItKeepsWholeRows) {
  History history(output(), "history.csv", {{"step", ""}});
  history.add({1});
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit small = before;
  small.rlim_cur = 8;  // the line of names, a row, and half of the next one
  setrlimit(RLIMIT_FSIZE, &small);
  const std::string message = error_text([&] { history.add({2.5}); });
  setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_EQ(message, in_folder("history.csv") + ": cannot be written: File too large");
  MPI_Barrier(MPI_COMM_WORLD);
  EXPECT_EQ(text(), "step\n1\n");
}

TEST_F(HistoryTest, WhatWasRemovedOrReplacedIsNamedAndItsRowsAreKept) {
  History history(output(), "history.csv", {{"step", ""}});
  history.add({1});
  if (folder().rank() == 0) {
    std::filesystem::remove(in_folder("history.csv"));
  }
  MPI_Barrier(MPI_COMM_WORLD);
  EXPECT_EQ(error_text([&] { history.add({2}); }),
            in_folder("history.csv") + " was removed or replaced while the run went on; its rows are in " +
                in_folder("history.csv"));
  EXPECT_EQ(error_text([&] { history.add({3}); }), "no Error");
  MPI_Barrier(MPI_COMM_WORLD);
  EXPECT_EQ(text(), "step\n1\n2\n3\n");
  MPI_Barrier(MPI_COMM_WORLD);

  if (folder().rank() == 0) {
    std::filesystem::remove(in_folder("history.csv"));
    write_file(in_folder("history.csv"), "mine");
  }
  MPI_Barrier(MPI_COMM_WORLD);
  EXPECT_NE(error_text([&] { history.add({4}); }).find("rescued_history.csv"), std::string::npos);
  MPI_Barrier(MPI_COMM_WORLD);
  EXPECT_EQ(text(), "mine");
  EXPECT_EQ(file_text(in_folder("rescued_history.csv")), "step\n1\n2\n3\n4\n");
  MPI_Barrier(MPI_COMM_WORLD);

  if (folder().rank() == 0) {
    std::filesystem::remove_all(folder() / "out");
  }
  MPI_Barrier(MPI_COMM_WORLD);
  const std::string message = error_text([&] { history.add({5}); });
  EXPECT_EQ(message.find((folder() / "out") + ": the folder, or run_files.txt in it, was removed"), 0U) << message;
  MPI_Barrier(MPI_COMM_WORLD);
  EXPECT_EQ(text(), "step\n1\n2\n3\n4\n5\n");
  EXPECT_TRUE(std::filesystem::exists(in_folder("run.yaml")));
}

}  // namespace
}  // namespace pellicle
