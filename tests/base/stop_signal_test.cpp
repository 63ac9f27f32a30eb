#include "base/stop_signal.h"

#include <gtest/gtest.h>
#include <mpi.h>
#include <unistd.h>

#include <csignal>

namespace pellicle {
namespace {

bool is_last_rank() {
  int rank = 0;
  int ranks = 1;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  return rank == ranks - 1;
}

/// Passes until the work is left, the last rank getting a signal before the pass of this number.
int passes_until_left(StopPoint& stop, int pass_of_signal, int microseconds = 0) {
  int passes = 0;
  const int signal = until_stopped([&] {
    while (true) {
      if (++passes == pass_of_signal && is_last_rank()) {
        std::raise(SIGUSR1);
      }
      stop.pass();
      leave_if_stopped();
      usleep(static_cast<useconds_t>(microseconds));
    }
  });
  EXPECT_EQ(signal, SIGUSR1);
  return passes;
}

/// @returns the largest of all ranks @param same whether it is so on all of them
int largest(int value, bool& same) {
  int least = value;
  int most = value;
  MPI_Allreduce(MPI_IN_PLACE, &least, 1, MPI_INT, MPI_MIN, MPI_COMM_WORLD);
  MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
  same = least == most;
  return most;
}

TEST(StopSignal, AllRanksLeaveTheirWorkInTheSamePass) {
  catch_stop_signals(0);
  StopPoint stop;
  for (const int pass : {1, 2, 100, 777}) {
    defer_stop_signals();
    bool same = false;
    const int left = largest(passes_until_left(stop, pass), same);
    EXPECT_TRUE(same);
    EXPECT_GE(left, pass);
    EXPECT_LT(left, pass + 64);
  }
}

TEST(StopSignal, SlowPassesAreLeftAtOnce) {
  catch_stop_signals(0);
  defer_stop_signals();
  StopPoint stop;
  bool same = false;
  EXPECT_EQ(largest(passes_until_left(stop, 4, 120000), same), 4);
  EXPECT_TRUE(same);
}

TEST(StopSignal, WorkThatIsDoneIsNotLeft) {
  catch_stop_signals(0);
  defer_stop_signals();
  StopPoint stop;
  std::raise(SIGUSR1);
  EXPECT_FALSE(stop.pass()) << "outside of until_stopped";
  EXPECT_EQ(until_stopped([] {}), 0);
  EXPECT_EQ(stop_signal(), SIGUSR1);
  int begun = 0;
  EXPECT_EQ(until_stopped([&] {
              ++begun;
              EXPECT_TRUE(stop.pass());
              EXPECT_TRUE(stop.pass()) << "and from there on everywhere";
              leave_if_stopped();
              ++begun;
            }),
            SIGUSR1);
  EXPECT_EQ(begun, 1);
  leave_if_stopped();  // It does not: nothing is in progress.
  defer_stop_signals();
  EXPECT_EQ(until_stopped([&] { EXPECT_FALSE(stop.pass()); }), 0);
}

TEST(StopSignal, SigcontCountsOnce) {
  catch_stop_signals(0);
  defer_stop_signals();
  StopPoint stop;
  const auto pass_all = [&] {
    for (int pass = 0; pass < 64; ++pass) {
      stop.pass();
      leave_if_stopped();
    }
  };
  if (is_last_rank()) {
    std::raise(SIGCONT);
  }
  EXPECT_EQ(until_stopped(pass_all), 0) << "not heeded";
  EXPECT_EQ(until_stopped(pass_all, true), SIGCONT);
  EXPECT_EQ(until_stopped(pass_all, true), 0);
  EXPECT_EQ(stop_signal(), 0);
  std::raise(SIGCONT);
  EXPECT_EQ(stop_signal(), SIGCONT);
  EXPECT_EQ(stop_signal(), 0);
  if (is_last_rank()) {
    std::raise(SIGCONT);
    std::raise(SIGTERM);
  }
  EXPECT_EQ(until_stopped(pass_all, true), SIGTERM) << "which counts more";
  defer_stop_signals();
}

TEST(StopSignal, TheLimitOfProcessorTimeIsSaidEverySecond) {
  catch_stop_signals(0);
  defer_stop_signals();
  std::raise(SIGXCPU);
  std::raise(SIGXCPU);  // Any other second signal would have ended this process.
  EXPECT_EQ(stop_signal(), SIGXCPU);
  EXPECT_EQ(signal_name(SIGXCPU), "SIGXCPU");
}

}  // namespace
}  // namespace pellicle
