#include "io/history.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "tests/io/files.h"

namespace pellicle {
namespace {

TEST(History, WritesNamesUnitsAndAllDigits) {
  const TestFolder folder;
  const std::string path = folder / "out/history.csv";
  History history(MPI_COMM_WORLD, path, {{"time", "s"}, {"step", ""}, {"mass_left", "kg"}});
  const double third = 1.0 / 3;
  history.add({0.1, 1, third});
  history.add({0.2, 2, std::nan("")});
  MPI_Barrier(MPI_COMM_WORLD);
  // Read while the file is still open: every row has reached it.
  const std::string text = file_text(path);
  EXPECT_EQ(text.substr(0, text.find('\n')), "time [s],step,mass_left [kg]");
  const std::string first = text.substr(text.find('\n') + 1);
  EXPECT_EQ(first, "0.10000000000000001,1,0.33333333333333331\n0.20000000000000001,2,nan\n");
  EXPECT_EQ(std::strtod(first.c_str() + first.find(",1,") + 3, nullptr), third);
}

TEST(History, ReplacesAnOlderFile) {
  const TestFolder folder;
  const std::string path = folder / "history.csv";
  { History(MPI_COMM_WORLD, path, {{"old", ""}}).add({1}); }
  { const History newer(MPI_COMM_WORLD, path, {{"new", ""}}); }
  MPI_Barrier(MPI_COMM_WORLD);
  EXPECT_EQ(file_text(path), "new\n");
}

TEST(History, FaultsEndAllRanks) {
  const TestFolder folder;
  if (folder.rank() == 0) {
    write_file(folder / "file", "in the way");
  }
  MPI_Barrier(MPI_COMM_WORLD);
  EXPECT_EQ(error_text([&] {
              History(MPI_COMM_WORLD, folder / "file/history.csv", {{"time", "s"}});
            }),
            (folder / "file/history.csv") + ": cannot be written: Not a directory");
  EXPECT_EQ(error_text([&] {
              History(MPI_COMM_WORLD, "/dev/full", {{"time", "s"}});
            }),
            "/dev/full: cannot be written: No space left on device");
  History history(MPI_COMM_WORLD, folder / "history.csv", {{"time", "s"}, {"step", ""}});
  EXPECT_THROW(history.add({1}), std::logic_error);
}

}  // namespace
}  // namespace pellicle
