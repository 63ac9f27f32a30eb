#pragma once

namespace pellicle {
inline namespace base {
class OptionTable;
}  // namespace base
inline namespace world {

/// When the state of a run is kept.
struct CheckpointOptions {
  int interval_steps = 0;       ///< steps between checkpoints; 0: only the wall clock counts
  double interval_wall = 1800;  ///< wall-clock time between checkpoints [s]; 0: only steps count
  int keep = 2;                 ///< how many are kept, the newest ones; 0: none is written
};

/// Declares the options `checkpoint.*`.
void describe(OptionTable& table, CheckpointOptions& options);

}  // namespace world
}  // namespace pellicle
