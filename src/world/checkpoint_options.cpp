#include "world/checkpoint_options.h"

#include <algorithm>

#include "options/options.h"

namespace pellicle {
inline namespace world {

double CheckpointOptions::wall_interval(double elapsed, bool is_first) const {
  return interval_wall.value_or(is_first ? 30 : std::max(180.0, elapsed / 20));
}

void describe(OptionTable& table, CheckpointOptions& options) {
  const Condition kept{"checkpoint.keep: more than 0", [&options] { return options.keep > 0; }};
  table.add("checkpoint.interval_steps", options.interval_steps)
      .at_least(0)
      .acts_with(kept)
      .help("steps between checkpoints, from which -restart goes on; 0: none by steps");
  table.add("checkpoint.interval_wall", options.interval_wall)
      .unit("s")
      .at_least(0)
      .acts_with(kept)
      .help(
          "time on the wall between checkpoints, such as 30 min; 0: none by this clock; by default 3 min, or a "
          "twentieth of the time since the run began if that is longer, and the first after 30 s");
  table.add("checkpoint.keep", options.keep)
      .at_least(0)
      .help(
          "how many checkpoints are kept, the newest ones; one is also written at the end of the run, whatever ends "
          "it; "
          "0: none");
}

}  // namespace world
}  // namespace pellicle
