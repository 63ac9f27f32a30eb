#include "io/console.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <regex>
#include <sstream>

#include "base/stage_clock.h"

namespace pellicle {
namespace {

/// What the console printed of a run of six steps.
std::string run(int monitor, bool terminal) {
  std::ostringstream stream;
  Console console(MPI_COMM_WORLD, monitor, stream, terminal);
  console.say("quality");
  for (int step = 1; step <= 6; ++step) {
    Progress progress;
    progress.step = step;
    progress.time = 0.5 * step;
    progress.fraction = step / 6.0;
    progress.iterations = 10 * step;
    progress.figures = "|C| 1.250e-01 m";
    console.progress(progress);
  }
  return stream.str();
}

void wait(double seconds) {
  const double end = MPI_Wtime() + seconds;
  while (MPI_Wtime() < end) {
  }
}

int lines(const std::string& text) { return static_cast<int>(std::count(text.begin(), text.end(), '\n')); }

TEST(Console, SpeaksOnATerminalOrWhenAsked) {
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  const int rank_speaks = rank == 0 ? 1 : 0;
  EXPECT_EQ(run(0, false), "");
  EXPECT_EQ(lines(run(0, true)), 7 * rank_speaks);
  EXPECT_EQ(lines(run(3, true)), 3 * rank_speaks);
  EXPECT_EQ(lines(run(2, false)), 4 * rank_speaks);
  if (rank == 0) {
    const std::regex line("step +6  time 3 +s 100\\.0 %  left 0 s +iterations +60  \\|C\\| 1\\.250e-01 m\n");
    EXPECT_TRUE(std::regex_search(run(6, false), line)) << run(6, false);
  }
}

TEST(Console, TellsWhatALogNeedsWhereNobodyWatches) {
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  std::ostringstream stream;
  Console console(MPI_COMM_WORLD, 0, stream, false, 0.05);
  console.say("quality");
  console.tell("mesh");
  console.progress({1, 0.5, 0.1, 10, ""});
  EXPECT_EQ(stream.str(), rank == 0 ? "mesh\n" : "");
  wait(0.06);
  console.progress({2, 1, 0.2, 10, ""});
  console.progress({3, 1.5, 0.3, 10, ""});
  EXPECT_EQ(lines(stream.str()), rank == 0 ? 2 : 0) << "a progress line after the longest silence, and no more";
}

TEST(Console, DurationsAreReadable) {
  EXPECT_EQ(duration_text(0.346), "0.35 s");
  EXPECT_EQ(duration_text(9.96), "10 s");
  EXPECT_EQ(duration_text(59.6), "1 min 00 s");
  EXPECT_EQ(duration_text(185), "3 min 05 s");
  EXPECT_EQ(duration_text(7800), "2 h 10 min");
}

TEST(Console, StageTableHasTheSlowestRanksTimes) {
  int rank = 0;
  int ranks = 1;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  StageClock clock({"heat", "projection"});
  {
    const auto timer = clock.time("heat");
    wait(rank == ranks - 1 ? 0.03 : 0);
  }
  { const auto timer = clock.time("heat"); }
  std::ostringstream stream;
  Console console(MPI_COMM_WORLD, 1, stream, false);
  console.stage_table({{"", &clock}});
  if (rank != 0) {
    EXPECT_EQ(stream.str(), "");
    return;
  }
  std::smatch match;
  const std::string table = stream.str();
  ASSERT_TRUE(std::regex_search(table, match, std::regex("heat +2 +([0-9.]+) +[0-9.]+ %\n"))) << table;
  EXPECT_GE(std::stod(match[1]), 0.0295);
  EXPECT_TRUE(std::regex_search(table, std::regex("projection +0 +0\\.000 +0\\.0 %\n"))) << table;
  EXPECT_TRUE(std::regex_search(table, std::regex("total +[0-9.]+ +100\\.0 %\n"))) << table;
}

TEST(StageClock, AddsUpCallsAndLaps) {
  StageClock clock({"one", "two"});
  { const auto timer = clock.time("two"); }
  clock.start_lap();
  {
    const auto timer = clock.time("two");
    wait(0.01);
  }
  EXPECT_EQ(clock.stages()[0].calls, 0);
  EXPECT_EQ(clock.stages()[1].calls, 2);
  EXPECT_GE(clock.stages()[1].lap_seconds, 0.01);
  EXPECT_GE(clock.stages()[1].seconds, clock.stages()[1].lap_seconds);
  EXPECT_GE(clock.elapsed(), clock.stages()[1].seconds);
  EXPECT_THROW((void)clock.time("three"), std::logic_error);
  PetscLogStage stage = -1;
  PetscLogStageGetId("two", &stage);
  EXPECT_GE(stage, 0) << "-log_view has no part for the stage";
}

}  // namespace
}  // namespace pellicle
