#pragma once

#include <optional>

#include "options/choice.h"

namespace pellicle::world {

/// When the state of a run is kept.
struct CheckpointOptions {
  int interval_steps = 0;  ///< steps between checkpoints; 0: only the wall clock counts
  /// Wall-clock time between checkpoints [s]; 0: only steps count; none: see wall_interval.
  std::optional<double> interval_wall;
  int keep = 2;  ///< how many are kept, the newest ones; 0: none is written

  /// Wall-clock time after which the next checkpoint is due [s]. Unless it is given: 30 s for the first one, so that a
  /// short run has one; afterwards a twentieth of the run's time, so that at most so much of it is done again, but no
  /// less than 3 min, so that writing them takes next to nothing of it.
  /// @param elapsed wall-clock time since the run began [s] @param is_first whether it has written none
  double wall_interval(double elapsed, bool is_first) const;
};

/// Declares the options `checkpoint.*`.
void describe(OptionTable& table, CheckpointOptions& options);

}  // namespace pellicle::world
