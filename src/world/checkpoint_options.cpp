#include "world/checkpoint_options.h"

#include <algorithm>

#include "options/options.h"

namespace pellicle::world {

double CheckpointOptions::wall_interval(double elapsed, bool is_first) const {
  return interval_wall.value_or(is_first ? 30 : std::max(180.0, elapsed / 20));
}

void describe(OptionTable& table, CheckpointOptions& options) {
  const Condition kept = is_positive("checkpoint.keep", options.keep);
  table.add("checkpoint.interval_steps", options.interval_steps, Rules().at_least(0).acts_with(kept),
            "steps between checkpoints, from which -restart goes on; 0: none by steps");
  table.add("checkpoint.interval_wall", options.interval_wall, Rules("s").at_least(0).acts_with(kept),
            "time on the wall between checkpoints, such as 30 min; 0: none by this clock; by default 3 min, or a "
            "twentieth of the time since the run began if that is longer, and the first after 30 s");
  table.add("checkpoint.keep", options.keep, Rules().at_least(0),
            "how many checkpoints are kept, the newest ones; one is also written at the end of the run, whatever ends "
            "it; 0: none");
}

}  // namespace pellicle::world
