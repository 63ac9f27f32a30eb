#include "base/stop_signal.h"

#include <gtest/gtest.h>
#include <mpi.h>
#include <unistd.h>

#include <csignal>

namespace pellicle {
namespace {

bool is_last_rank(MPI_Comm comm = MPI_COMM_WORLD) {
  int rank = 0;
  int ranks = 1;
  MPI_Comm_rank(comm, &rank);
  MPI_Comm_size(comm, &ranks);
  return rank == ranks - 1;
}

/// Passes until the work is left, the last rank getting a signal before the pass of this number.
int passes_until_left(MPI_Comm comm, StopPoint& stop, int pass_of_signal, int microseconds = 0) {
  int passes = 0;
  const int signal = until_stopped(comm, [&] {
    while (true) {
      if (++passes == pass_of_signal && is_last_rank(comm)) {
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
int largest(MPI_Comm comm, int value, bool& same) {
  int least = value;
  int most = value;
  MPI_Allreduce(MPI_IN_PLACE, &least, 1, MPI_INT, MPI_MIN, comm);
  MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPI_INT, MPI_MAX, comm);
  same = least == most;
  return most;
}

TEST(StopSignal, AllRanksLeaveTheirWorkInTheSamePass) {
  catch_stop_signals(0);
  StopPoint stop;
  for (const int pass : {1, 2, 100, 777}) {
    defer_stop_signals();
    bool same = false;
    const int left = largest(MPI_COMM_WORLD, passes_until_left(MPI_COMM_WORLD, stop, pass), same);
    EXPECT_TRUE(same);
    EXPECT_GE(left, pass);
    EXPECT_LT(left, pass + 64);
  }
}

TEST(StopSignal, RanksOfAnotherCommunicatorAreNotAsked) {
  catch_stop_signals(0);
  defer_stop_signals();
  int rank = 0;
  int ranks = 1;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  const bool is_at_work = 2 * rank < ranks;
  MPI_Comm half = MPI_COMM_NULL;
  MPI_Comm_split(MPI_COMM_WORLD, is_at_work ? 0 : 1, 0, &half);
  if (!is_at_work) {
    std::raise(SIGUSR2);
  }
  MPI_Barrier(MPI_COMM_WORLD);
  if (is_at_work) {
    StopPoint stop;
    EXPECT_EQ(stop_signal(half), 0) << "noted on the other half alone";
    EXPECT_EQ(until_stopped(half,
                            [&] {
                              for (int pass = 0; pass < 200; ++pass) {
                                stop.pass();
                                leave_if_stopped();
                              }
                            }),
              0);
    bool same = false;
    const int left = largest(half, passes_until_left(half, stop, 100), same);
    EXPECT_TRUE(same);
    EXPECT_GE(left, 100);
    EXPECT_LT(left, 100 + 64);
    EXPECT_EQ(stop_signal(half), SIGUSR1);
  }
  MPI_Barrier(MPI_COMM_WORLD);  // where the other half has waited
  if (!is_at_work) {
    EXPECT_EQ(stop_signal(half), SIGUSR2);
  }
  MPI_Comm_free(&half);
  defer_stop_signals();
}

TEST(StopSignal, SlowPassesAreLeftAtOnce) {
  catch_stop_signals(0);
  defer_stop_signals();
  StopPoint stop;
  bool same = false;
  EXPECT_EQ(largest(MPI_COMM_WORLD, passes_until_left(MPI_COMM_WORLD, stop, 4, 120000), same), 4);
  EXPECT_TRUE(same);
}

TEST(StopSignal, WorkThatIsDoneIsNotLeft) {
  catch_stop_signals(0);
  defer_stop_signals();
  StopPoint stop;
  std::raise(SIGUSR1);
  EXPECT_FALSE(stop.pass()) << "outside of until_stopped";
  EXPECT_EQ(until_stopped(MPI_COMM_WORLD, [] {}), 0);
  EXPECT_EQ(stop_signal(MPI_COMM_WORLD), SIGUSR1);
  int begun = 0;
  EXPECT_EQ(until_stopped(MPI_COMM_WORLD,
                          [&] {
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
  EXPECT_EQ(until_stopped(MPI_COMM_WORLD, [&] { EXPECT_FALSE(stop.pass()); }), 0);
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
  EXPECT_EQ(until_stopped(MPI_COMM_WORLD, pass_all), 0) << "not heeded";
  EXPECT_EQ(until_stopped(MPI_COMM_WORLD, pass_all, true), SIGCONT);
  EXPECT_EQ(until_stopped(MPI_COMM_WORLD, pass_all, true), 0);
  EXPECT_EQ(stop_signal(MPI_COMM_WORLD), 0);
  std::raise(SIGCONT);
  EXPECT_EQ(stop_signal(MPI_COMM_WORLD), SIGCONT);
  EXPECT_EQ(stop_signal(MPI_COMM_WORLD), 0);
  if (is_last_rank()) {
    std::raise(SIGCONT);
    std::raise(SIGTERM);
  }
  EXPECT_EQ(until_stopped(MPI_COMM_WORLD, pass_all, true), SIGTERM) << "which counts more";
  defer_stop_signals();
}

TEST(StopSignal, TheLimitOfProcessorTimeIsSaidEverySecond) {
  catch_stop_signals(0);
  defer_stop_signals();
  std::raise(SIGXCPU);
  std::raise(SIGXCPU);  // Any other second signal would have ended this process.
  EXPECT_EQ(stop_signal(MPI_COMM_WORLD), SIGXCPU);
  EXPECT_EQ(signal_name(SIGXCPU), "SIGXCPU");
}

}  // namespace
}  // namespace pellicle
