#include "run/step_control.h"

#include <gtest/gtest.h>

#include <cmath>
#include <csignal>
#include <sstream>

#include "base/error.h"
#include "base/stop_signal.h"
#include "tests/io/files.h"
#include "world/options.h"

namespace pellicle::step_control_test {
namespace {

/// A run whose state is the sum of its accepted steps. It fails where the test says so, and a failed attempt leaves a
/// wrong state behind.
class FakeRun : public SteppedRun {
 public:
  struct Row {
    double time;
    int step;
    double h;
    int retries;
  };

  double time() const override { return time_; }
  int step() const override { return step_; }
  double& length() override { return length_; }
  void save(Hdf5File&) const override {}
  StepResult advance(double h) override {
    ++attempts;
    h_ = h;
    sum_ += h;
    int rank = 0;
    int ranks = 1;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    if (attempts == signal_in_attempt && rank == ranks - 1) {
      std::raise(SIGUSR1);
    }
    for (int pass = 0; can_be_left && pass < 64; ++pass) {
      stop_.pass();
      leave_if_stopped();
    }
    StepResult result;
    if (fails_from <= time_ && time_ < fails_until && h > fails_above) {
      sum_ = 1e30;
      result.converged = false;
      result.reason = "the step is too long";
      return result;
    }
    result.iterations = 7;
    result.figures = "fine";
    if (error_factor > 0) {
      result.step_error = error_factor * h * h;
    }
    time_ += h;
    ++step_;
    return result;
  }
  void accept(double time) override { time_ = time; }
  std::string ended() const override { return time_ >= ends_at ? "nothing is left" : ""; }
  void keep() override { kept_ = sum_; }
  void restore() override { sum_ = kept_; }
  bool frame_due() const override {
    return frame_interval == 0 || std::floor(time_ / frame_interval + 1e-9) > std::floor(last_frame_ / frame_interval);
  }
  std::optional<double> next_frame_time() const override {
    if (frame_interval == 0) {
      return std::nullopt;
    }
    return (std::floor(time_ / frame_interval + 1e-9) + 1) * frame_interval;
  }
  void draw() override {
    if (!drawn.empty() && drawn.back() == time_) {
      return;
    }
    if (step_ == draw_fails_in_step) {
      throw Error("the disk is full");
    }
    drawn.push_back(time_);
    drawn_sum = sum_;
    last_frame_ = time_ + 1e-12;
  }
  std::string draw_failed(double h) override {
    if (failed_frame_fails) {
      throw Error("the disk is full");
    }
    failed_length = h;
    failed_sum = sum_;
    return "fake_failed.pvd";
  }
  void record(int retries) override {
    if (step_ == record_fails_in_step) {
      throw Error("history.csv was removed");
    }
    rows.push_back({time_, step_, h_, retries});
  }

  double sum() const { return sum_; }

  double fails_from = 0;   ///< [s]
  double fails_until = 0;  ///< [s]
  double fails_above = 0;  ///< this length [s]
  double error_factor = 0;
  double frame_interval = 0;
  double ends_at = 1e30;  ///< [s]
  int signal_in_attempt = -1;
  bool can_be_left = false;  ///< a step, at a signal
  int draw_fails_in_step = -1;
  int record_fails_in_step = -1;
  int attempts = 0;
  double drawn_sum = 0;
  bool failed_frame_fails = false;
  double failed_length = 0;
  double failed_sum = 0;
  std::vector<double> drawn;
  std::vector<Row> rows;

 private:
  double length_ = 0;
  double time_ = 0;
  int step_ = 0;
  double h_ = 0;  ///< of the last attempt [s]
  double sum_ = 0;
  double kept_ = 0;
  double last_frame_ = 0;
  StopPoint stop_;
};

std::string run(FakeRun& fake, const TimeOptions& options, int monitor = 0) {
  std::ostringstream stream;
  Console console(MPI_COMM_WORLD, monitor, stream, false);
  run_steps(fake, options, console);
  return stream.str();
}

/// The message of the Error with which a run ends, or "no Error".
std::string fault_of(FakeRun& fake, const TimeOptions& options) {
  return error_text([&] { run(fake, options); });
}

TimeOptions options_for(double step, double end) {
  TimeOptions options;
  options.step = step;
  options.end = end;
  return options;
}

std::vector<double> lengths(const FakeRun& fake) {
  std::vector<double> result;
  for (const FakeRun::Row& row : fake.rows) {
    result.push_back(row.h);
  }
  return result;
}

void expect_near(const std::vector<double>& values, const std::vector<double>& expected) {
  ASSERT_EQ(values.size(), expected.size()) << testing::PrintToString(values);
  for (std::size_t i = 0; i < values.size(); ++i) {
    EXPECT_NEAR(values[i], expected[i], 1e-12) << i;
  }
}

TEST(StepControl, EndsAtItsTimeWithTwoShorterSteps) {
  FakeRun fake;
  const std::string told = run(fake, options_for(0.3, 1), 1);
  expect_near(lengths(fake), {0.3, 0.3, 0.2, 0.2});
  expect_near(fake.drawn, {0.3, 0.6, 0.8, 1});
  EXPECT_DOUBLE_EQ(fake.sum(), 1);
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  if (rank == 0) {
    EXPECT_NE(told.find("time 1          s 100.0 %"), std::string::npos) << told;
    EXPECT_NE(told.find("iterations     7  fine"), std::string::npos) << told;
  }
}

TEST(StepControl, NoStepIsASliver) {
  for (const double more : {1e-3, 1e-6, 1e-8, 0.5, 0.999}) {
    FakeRun fake;
    run(fake, options_for(0.1, 0.1 * (4 + more)));
    EXPECT_DOUBLE_EQ(fake.time(), 0.1 * (4 + more));
    EXPECT_EQ(fake.step(), 5) << more;
    for (const double h : lengths(fake)) {
      EXPECT_GE(h, 0.05);
    }
  }
  FakeRun by_rounding;
  run(by_rounding, options_for(0.1, 0.4 + 1e-12));
  EXPECT_EQ(by_rounding.step(), 4);
}

TEST(StepControl, EndsAfterItsSteps) {
  FakeRun fake;
  TimeOptions options = options_for(0.1, 100);
  options.max_steps = 5;
  run(fake, options);
  EXPECT_EQ(fake.step(), 5);
}

TEST(StepControl, EndsBeforeItsTimeWithTheReason) {
  FakeRun fake;
  fake.ends_at = 0.45;
  fake.frame_interval = 10;
  const std::string told = run(fake, options_for(0.1, 1));
  EXPECT_EQ(fake.step(), 5);
  expect_near(fake.drawn, {0.5});
  EXPECT_EQ(fake.rows.size(), 5U);
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  EXPECT_EQ(told, rank == 0 ? "ended at 0.5 s: nothing is left\n" : "");
}

TEST(StepControl, TimesDoNotDrift) {
  FakeRun fake;
  run(fake, options_for(0.1, 10));
  EXPECT_EQ(fake.step(), 100);
  for (const FakeRun::Row& row : fake.rows) {
    EXPECT_EQ(row.time, row.step * 0.1);
  }
}

TEST(StepControl, HalvesAStepThatFailsAndDoublesAgain) {
  FakeRun fake;
  fake.fails_from = 0.75;
  fake.fails_until = 1.3;
  fake.fails_above = 0.3;
  run(fake, options_for(1, 4));
  // The first step begins at 0, before the trouble; the second fails at 1 and at 0.5.
  expect_near(lengths(fake), {1, 0.25, 0.25, 0.5, 1, 1});
  EXPECT_DOUBLE_EQ(fake.sum(), 4) << "what a failed attempt left was not put back";
  EXPECT_EQ(fake.rows[1].retries, 2);
  EXPECT_EQ(fake.rows[2].retries, 1);
  EXPECT_EQ(fake.rows[3].retries, 0);
  EXPECT_EQ(fake.attempts, 6 + 3);
}

TEST(StepControl, StopsWithTheReasonAndTheLastGoodState) {
  FakeRun fake;
  fake.fails_from = 1.5;
  fake.fails_until = 9;
  fake.frame_interval = 10;
  TimeOptions options = options_for(1, 4);
  options.max_retries = 3;
  EXPECT_EQ(fault_of(fake, options),
            "step 3 at time 2.000000 s failed, down to a length of 0.125 s: the step is too long; the state before "
            "it is the last frame; the state in which it failed is fake_failed.pvd");
  EXPECT_DOUBLE_EQ(fake.failed_length, 0.125);
  EXPECT_NE(fake.failed_sum, 2) << "not the state that was put back";
  EXPECT_EQ(fake.attempts, 2 + 4);
  expect_near(fake.drawn, {2});
  EXPECT_DOUBLE_EQ(fake.drawn_sum, 2);
  EXPECT_EQ(fake.rows.size(), 2U);
}

TEST(StepControl, TellsEveryStepThatIsHalvedAndWhy) {
  FakeRun fake;
  fake.fails_from = 0.75;
  fake.fails_until = 1.3;
  fake.fails_above = 0.3;
  const std::string told = run(fake, options_for(1, 4));
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  EXPECT_EQ(told, rank > 0
                      ? ""
                      : "step 2 at time 1 s failed: the step is too long; tried again with 0.5 s\n"
                        "step 2 at time 1 s failed: the step is too long; tried again with 0.25 s\n"
                        "step 3 at time 1.25 s failed: the step is too long; tried again with 0.25 s\n"
                        "steps: 2 of 6 were tried again, 3 times in all with half the length; they were 0.666667 s "
                        "long in the mean: try time.step 0.5\n");
}

TEST(StepControl, ASignalToAnyRankEndsTheRunAfterItsStep) {
  catch_stop_signals(0);
  FakeRun fake;
  fake.frame_interval = 10;
  fake.signal_in_attempt = 3;
  try {
    run(fake, options_for(0.5, 4));
    FAIL() << "no error";
  } catch (const Interrupted& interrupted) {
    EXPECT_EQ(interrupted.signal(), SIGUSR1);
    EXPECT_STREQ(interrupted.what(), "ended by SIGUSR1 at 1.5 s after step 3, which is the last frame and row");
  }
  expect_near(fake.drawn, {1.5});
  EXPECT_EQ(fake.rows.size(), 3U);
  EXPECT_EQ(fault_of(fake, options_for(0.5, 4)), "no Error") << "the next run does not know of it";
}

TEST(StepControl, AStepThatIsLeftAtASignalIsUndone) {
  catch_stop_signals(0);
  FakeRun fake;
  fake.frame_interval = 10;
  fake.signal_in_attempt = 3;
  fake.can_be_left = true;
  EXPECT_EQ(fault_of(fake, options_for(0.5, 4)),
            "ended by SIGUSR1 at 1 s after step 2, which is the last frame and row; step 3 had begun and is undone");
  expect_near(fake.drawn, {1});
  EXPECT_NEAR(fake.drawn_sum, 1, 1e-12) << "restored";
  EXPECT_EQ(fake.rows.size(), 2U);
  EXPECT_EQ(fake.attempts, 3) << "it is not tried again";
  EXPECT_EQ(fault_of(fake, options_for(0.5, 4)), "no Error") << "the next run does not know of it";
}

TEST(StepControl, ASignalEndsTheSearchForAShorterStep) {
  catch_stop_signals(0);
  FakeRun fake;
  fake.frame_interval = 10;
  fake.fails_from = 1;
  fake.fails_until = 9;
  fake.signal_in_attempt = 4;  // the second one of the third step
  EXPECT_EQ(fault_of(fake, options_for(0.5, 4)),
            "ended by SIGUSR1 at 1 s after step 2, which is the last frame and row; step 3 had begun and is undone");
  EXPECT_EQ(fake.attempts, 4);
  expect_near(fake.drawn, {1});
}

TEST(StepControl, WhatCanBeKeptOfAStepIsKept) {
  FakeRun without_history;
  without_history.frame_interval = 10;
  without_history.record_fails_in_step = 2;
  EXPECT_EQ(fault_of(without_history, options_for(0.5, 4)),
            "history.csv was removed; ended at 1 s after step 2, the last frame");
  expect_near(without_history.drawn, {1});
  FakeRun without_frame;
  without_frame.draw_fails_in_step = 2;
  EXPECT_EQ(fault_of(without_frame, options_for(0.5, 4)),
            "the disk is full; ended at 1 s after step 2, of which there is no frame");
  EXPECT_EQ(without_frame.rows.size(), 2U);
}

TEST(StepControl, TheLastGoodStateIsKeptWhereTheOneThatFailedCannotBeDrawn) {
  FakeRun fake;
  fake.frame_interval = 10;
  fake.fails_from = 1;
  fake.fails_until = 9;
  fake.failed_frame_fails = true;
  const std::string fault = fault_of(fake, options_for(0.5, 4));
  EXPECT_NE(
      fault.find("; the state before it is the last frame; of the state in which it failed there is no frame: the "
                 "disk is full"),
      std::string::npos)
      << fault;
  expect_near(fake.drawn, {1});
  EXPECT_DOUBLE_EQ(fake.drawn_sum, 1);
}

/// The steps that succeed become ever shorter.
class HardeningRun : public FakeRun {
 public:
  StepResult advance(double h) override {
    fails_above = std::exp2(-time());
    return FakeRun::advance(h);
  }
};

TEST(StepControl, StepsDoNotDieAway) {
  HardeningRun fake;
  fake.fails_until = 9;
  TimeOptions options = options_for(1, 9);
  options.max_retries = 3;
  EXPECT_THROW(run(fake, options), Error);
  EXPECT_NEAR(fake.rows.back().h, 0.125, 1e-12);
  EXPECT_GT(fake.time(), 3);
  EXPECT_LT(fake.time(), 3.2);
}

TEST(StepControl, AStateThatIsDrawnIsNotDrawnAgainOnFailure) {
  FakeRun fake;
  fake.fails_from = 0.5;
  fake.fails_until = 9;
  EXPECT_THROW(run(fake, options_for(1, 4)), Error);
  expect_near(fake.drawn, {1});
}

TEST(StepControl, LengthsFollowFromTheError) {
  FakeRun fake;
  fake.error_factor = 1;
  TimeOptions options = options_for(0.1, 20);
  options.tolerance = 0.16;
  options.max_step = 5;
  run(fake, options);
  // Error h^2: the length at which it is the tolerance is 0.4, of which the control takes nine tenths; it doubles at
  // most.
  ASSERT_GT(fake.rows.size(), 10U);
  expect_near({fake.rows[0].h, fake.rows[1].h, fake.rows[2].h, fake.rows[3].h}, {0.1, 0.2, 0.36, 0.36});
  EXPECT_DOUBLE_EQ(fake.time(), 20);

  FakeRun steep;
  steep.error_factor = 100;
  run(steep, options);
  // Down: by half at most. Error 100 h^2 is the tolerance at 0.04.
  expect_near({steep.rows[0].h, steep.rows[1].h, steep.rows[2].h, steep.rows[3].h}, {0.1, 0.05, 0.036, 0.036});
}

TEST(StepControl, AdaptiveLengthsStayWithinBounds) {
  FakeRun fake;
  fake.error_factor = 1;
  TimeOptions options = options_for(0.1, 2);
  options.tolerance = 1e6;
  run(fake, options);
  for (const FakeRun::Row& row : fake.rows) {
    EXPECT_LE(row.h, 0.1 + 1e-12) << "time.step is the longest unless time.max_step is given";
  }
  options.tolerance = 1e-12;
  options.max_retries = 2;
  FakeRun hard;
  hard.error_factor = 1;
  run(hard, options);
  EXPECT_NEAR(hard.rows[10].h, 0.025, 1e-12) << "never shorter than after max_retries halvings";
}

TEST(StepControl, AdaptiveStepsEndAtFrames) {
  FakeRun fake;
  fake.error_factor = 1;
  fake.frame_interval = 0.5;
  TimeOptions options = options_for(0.1, 2);
  options.tolerance = 0.16;
  options.max_step = 5;
  run(fake, options);
  expect_near(fake.drawn, {0.5, 1, 1.5, 2});
  // A step that a frame cut short does not shorten the one after it.
  expect_near(lengths(fake), {0.1, 0.2, 0.2, 0.25, 0.25, 0.25, 0.25, 0.25, 0.25});
}

TEST(StepControl, AFailureShortensAdaptiveStepsToo) {
  FakeRun fake;
  fake.error_factor = 1;
  fake.fails_from = 0.05;
  fake.fails_until = 0.2;
  fake.fails_above = 0.1;
  TimeOptions options = options_for(0.1, 2);
  options.tolerance = 0.16;
  options.max_step = 5;
  run(fake, options);
  expect_near({fake.rows[0].h, fake.rows[1].h, fake.rows[2].h, fake.rows[3].h}, {0.1, 0.1, 0.2, 0.36});
  EXPECT_EQ(fake.rows[1].retries, 1);
}

TEST(StepControl, CheckpointsByTheClockComeSoonAndThenRarely) {
  CheckpointOptions options;
  EXPECT_EQ(options.wall_interval(10, true), 30);
  EXPECT_EQ(options.wall_interval(40, false), 180);
  EXPECT_EQ(options.wall_interval(3600, false), 180);
  EXPECT_EQ(options.wall_interval(36000, false), 1800);
  for (const double given : {0.0, 5.0, 1800.0}) {
    options.interval_wall = given;
    EXPECT_EQ(options.wall_interval(10, true), given);
    EXPECT_EQ(options.wall_interval(36000, false), given);
  }
}

}  // namespace
}  // namespace pellicle::step_control_test
