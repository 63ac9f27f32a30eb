#pragma once

#include <memory>

#include "base/stage_clock.h"
#include "io/history.h"
#include "simulation/inflate.h"

namespace pellicle {

/// The books of a balloon: a row of history.csv for the initial state and for each step.
class BalloonLedger {
 public:
  /// Makes the file. Chain and clock must outlive it. Collective. @throws Error when it cannot be written
  BalloonLedger(const Inflate& chain, const Options& options, const StageClock& clock);

  /// @param h length of the step [s]
  /// @param retries how often it was tried again. Collective.
  void add(const BalloonState& state, const InflateStep& step, double h, int retries);

 private:
  const Inflate& chain_;
  const StageClock& clock_;
  std::unique_ptr<History> history_;
  double initial_rubber_volume_ = 0;      ///< [m^3]
  std::unique_ptr<Field> last_position_;  ///< positions of the last row, to see what turned over since
};

}  // namespace pellicle
