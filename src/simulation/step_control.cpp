#include "simulation/step_control.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/units.h"

namespace pellicle {

namespace {

/// A time within rounding of a whole number of steps becomes that number of steps: sums of steps drift.
double without_drift(double time, double step) {
  const double whole = std::round(time / step) * step;
  return std::abs(time - whole) < 1e-9 * step ? whole : time;
}

/// Length of the next step [s].
/// @param h length of the last step @param length what it would have been if no frame or end had cut it short
double next_length(double h, double length, const StepResult& step, const TimeOptions& options) {
  if (options.tolerance == 0) {
    return std::min(2 * h, options.step);
  }
  // The error of a step of the implicit Euler method grows with h^2.
  const double wanted = 0.9 * std::sqrt(options.tolerance / step.step_error.value()) * h;
  return std::clamp(std::clamp(wanted, 0.5 * h, std::max(2 * h, length)), options.shortest_step(),
                    options.longest_step());
}

}  // namespace

void run_steps(Chain& chain, const TimeOptions& options, Console& console, StageClock& clock) {
  const auto is_last = [&] {
    return !chain.ended().empty() || chain.time() >= options.end - 1e-9 * options.step ||
           (options.max_steps > 0 && chain.step() >= options.max_steps);
  };
  double length = options.step;  // before it is cut to end at a frame or at the end of the run
  int last_drawn = chain.step();
  while (!is_last()) {
    clock.start_lap();
    chain.keep();
    double h = std::min(length, options.end - chain.time());
    if (options.tolerance > 0) {
      const std::optional<double> frame = chain.next_frame_time();
      if (frame && *frame - chain.time() > 1e-9 * options.step) {
        h = std::min(h, *frame - chain.time());
      }
    }
    int retries = 0;
    StepResult step = chain.advance(h);
    while (!step.converged && h / 2 >= options.shortest_step()) {
      chain.restore();
      h /= 2;
      length = h;
      ++retries;
      step = chain.advance(h);
    }
    if (!step.converged) {
      chain.restore();
      if (last_drawn != chain.step()) {
        chain.draw();
      }
      throw Error("step " + std::to_string(chain.step() + 1) + " at time " + std::to_string(chain.time()) +
                  " s failed, down to a length of " + number_text(h) + " s: " + step.reason +
                  "; the state before it is the last frame");
    }
    chain.accept(without_drift(chain.time(), options.step));
    if (is_last() || chain.frame_due()) {
      chain.draw();
      last_drawn = chain.step();
    }
    chain.record(h, retries);
    const double share =
        std::max(chain.time() / options.end, options.max_steps > 0 ? chain.step() / double(options.max_steps) : 0.0);
    console.progress({chain.step(), chain.time(), std::min(1.0, share), step.iterations, step.figures});
    length = next_length(h, length, step, options);
  }
  if (!chain.ended().empty()) {
    console.conclude("ended at " + number_text(chain.time()) + " s: " + chain.ended());
  }
}

}  // namespace pellicle
