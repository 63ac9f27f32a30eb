#include "run/step_control.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <functional>

#include "base/error.h"
#include "base/stop_signal.h"

namespace pellicle::run {

namespace {

/// A time that is a whole number of steps except for rounding becomes that number of steps: sums of steps drift.
double without_drift(double time, double step) {
  const double whole = std::round(time / step) * step;
  return std::abs(time - whole) < 1e-9 * step ? whole : time;
}

/// Length of a step on the way to a time: what is left before it is shared by the last two steps, so that no step is a
/// sliver. @param rest before that time [s] @param length of the step if nothing shortens it [s] @param rounding of
/// times [s]
double length_towards(double rest, double length, double rounding) {
  return rest <= length + rounding ? rest : rest < 2 * length - rounding ? rest / 2 : length;
}

/// Length of the next step [s].
/// @param h length of the last step @param length the length that it would have had if no frame or end had shortened it
double next_length(double h, double length, const StepResult& step, const TimeOptions& options) {
  if (options.tolerance == 0) {
    return std::min(2 * h, options.step);
  }
  // See TimeIntegrator::error.
  const double power = options.scheme == TimeScheme::generalized_alpha ? 3 : 2;
  const double wanted = 0.9 * std::pow(options.tolerance / step.step_error.value(), 1 / power) * h;
  return std::clamp(std::clamp(wanted, 0.5 * h, std::max(2 * h, length)), options.shortest_step(),
                    options.longest_step());
}

/// How steps have gone since a run began or went on.
struct StepCounts {
  int steps = 0;
  int tried_again = 0;  ///< steps
  int retries = 0;      ///< of all of them
  long newton_iterations = 0;
  double length = 0;  ///< of all of them [s]

  void note(double h, int retries_of_step, int newton) {
    ++steps;
    tried_again += retries_of_step > 0 ? 1 : 0;
    retries += retries_of_step;
    newton_iterations += newton;
    length += h;
  }
};

/// Lines about steps that were hard, with what to try.
std::vector<std::string> remarks_of(const StepCounts& counts, const TimeOptions& options) {
  std::vector<std::string> lines;
  if (counts.steps == 0) {
    return lines;
  }
  if (counts.retries > 0) {
    lines.push_back(fmt::format(
        "steps: {} of {} were tried again, {} times in all with half the length; they were {} long in the mean: "
        "try time.step {:.2g}",
        counts.tried_again, counts.steps, counts.retries, time_text(counts.length / counts.steps),
        std::min(options.step / 2, counts.length / counts.steps)));
  }
  constexpr double many = 10;
  if (const double mean = static_cast<double>(counts.newton_iterations) / counts.steps; mean > many) {
    lines.push_back(fmt::format(
        "Newton's method: {:.1f} iterations a step in the mean: try a time.step of {:.2g}, from whose start the end "
        "is nearer, or a softer material, gas or contact",
        mean, options.step / 2));
  }
  return lines;
}

/// Writes the row of a step, and its frame if one is due. If one of them fails the other is written nevertheless, and
/// so is a checkpoint, unless that would go on from a row that is missing.
/// @throws Error, the first fault, after as much of the state as possible has been written
void write_step(SteppedRun& run, bool with_frame, int retries, const std::function<void()>& checkpoint) {
  std::string fault;
  const auto succeeds = [&fault](const std::function<void()>& work) {
    try {
      work();
      return true;
    } catch (const Error& error) {
      fault = fault.empty() ? error.what() : fault;
      return false;
    }
  };
  bool is_drawn = with_frame && succeeds([&] { run.draw(); });
  const bool is_recorded = succeeds([&] { run.record(retries); });
  if (fault.empty()) {
    return;
  }
  is_drawn = is_drawn || succeeds([&] { run.draw(); });
  if (is_recorded) {
    succeeds(checkpoint);
  }
  throw Error(fault + "; ended at " + time_text(run.time()) + " after step " + std::to_string(run.step()) +
              (is_drawn ? ", the last frame" : ", of which there is no frame"));
}

/// Draws the state in which a step has failed. @returns the end of a message
std::string draw_failed(SteppedRun& run, double h) {
  try {
    return "; the state in which it failed is " + run.draw_failed(h);
  } catch (const Error& error) {
    return std::string("; of the state in which it failed there is no frame: ") + error.what();
  }
}

}  // namespace

void run_steps(SteppedRun& run, const TimeOptions& options, Console& console, Checkpoints* checkpoints) {
  StepCounts counts;
  const auto is_last = [&] {
    return !run.ended().empty() || run.time() >= options.end - 1e-9 * options.step ||
           (options.max_steps > 0 && run.step() >= options.max_steps);
  };
  const auto tell_remarks = [&] {
    console.tell(run.remarks());
    console.tell(remarks_of(counts, options));
  };
  const auto checkpoint = [&] {
    if (checkpoints != nullptr) {
      checkpoints->write(run);
    }
  };
  const auto checkpoint_by_clock = [&] {
    if (checkpoints != nullptr && checkpoints->due_by_clock(run.step())) {
      checkpoint();
    }
  };
  const auto answer = [&](int signal, bool within_step) {
    checkpoint();  // before the frame: whoever sends a signal may kill what does not end soon
    if (signal == SIGCONT) {
      return;
    }
    run.draw();
    tell_remarks();
    throw Interrupted(signal,
                      "ended by " + signal_name(signal) + " at " + time_text(run.time()) + " after step " +
                          std::to_string(run.step()) + ", which is the last frame and row" +
                          (within_step ? "; step " + std::to_string(run.step() + 1) + " had begun and is undone" : ""));
  };
  if (run.length() == 0 || options.tolerance == 0) {
    run.length() = run.length() == 0 ? options.step : std::min(run.length(), options.step);
  }
  defer_stop_signals();
  while (!is_last()) {
    if (const int signal = stop_signal(console.comm()); signal != 0) {
      answer(signal, false);
    }
    run.keep();
    double length = run.length();  // before it is shortened to end at a frame or at the end of the run
    const double rounding = 1e-9 * options.step;
    double h = length_towards(options.end - run.time(), length, rounding);
    if (options.tolerance > 0) {
      const std::optional<double> frame = run.next_frame_time();
      if (frame && *frame - run.time() > rounding) {
        h = std::min(h, length_towards(*frame - run.time(), length, rounding));
      }
    }
    int retries = 0;
    StepResult step;
    const auto advance = [&] {
      while (true) {
        const bool heeds_sigcont = checkpoints != nullptr && checkpoints->lacks(run.step());
        int signal = 0;
        try {
          signal = until_stopped(
              console.comm(), [&] { step = run.advance(h); }, heeds_sigcont);
        } catch (const Error&) {
          run.restore();
          try {
            checkpoint();
          } catch (const Error&) {
            // The first fault is the one that is reported.
          }
          throw;
        }
        if (signal == 0 && !step.converged) {
          signal = stop_signal(console.comm());
        }
        if (signal == 0) {
          return step.converged;
        }
        run.restore();
        answer(signal, true);
      }
    };
    while (!advance() && h / 2 >= options.shortest_step()) {
      run.restore();
      h /= 2;
      console.tell("step " + std::to_string(run.step() + 1) + " at time " + time_text(run.time()) +
                   " failed: " + step.reason + "; tried again with " + time_text(h));
      length = h;
      ++retries;
      checkpoint_by_clock();
    }
    if (!step.converged) {
      const std::string failed_state = draw_failed(run, h);
      run.restore();
      std::string kept = "; the state before it is the last frame";
      try {
        run.draw();
        checkpoint();
      } catch (const Error& error) {
        kept = std::string("; of the state before it there is no frame: ") + error.what();
      }
      tell_remarks();
      throw Error("step " + std::to_string(run.step() + 1) + " at time " + std::to_string(run.time()) +
                  " s failed, down to a length of " + time_text(h) + ": " + step.reason + kept + failed_state);
    }
    counts.note(h, retries, step.newton_iterations);
    run.accept(without_drift(run.time(), options.step));
    write_step(run, is_last() || run.frame_due(), retries, checkpoint);
    const double fraction =
        std::max(run.time() / options.end, options.max_steps > 0 ? run.step() / double(options.max_steps) : 0.0);
    console.progress({run.step(), run.time(), std::min(1.0, fraction), step.iterations, step.figures});
    run.length() = next_length(h, length, step, options);
    if (is_last() || (checkpoints != nullptr && checkpoints->due_by_steps(run.step()))) {
      checkpoint();
    } else {
      checkpoint_by_clock();
    }
  }
  if (!run.ended().empty()) {
    console.tell("ended at " + time_text(run.time()) + ": " + run.ended());
  }
  tell_remarks();
}

}  // namespace pellicle::run
