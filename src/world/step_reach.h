#pragma once

#include <string>

#include "surface/surface.h"
#include "world/object_state.h"
#include "world/options.h"

namespace pellicle {
inline namespace world {

/// In words, what would move so far in the step to come, or turn so far, that neither contact nor a balance of forces
/// could follow: vertices by their velocities, gravity or the wind, or what a deck leads along a path. Empty: nothing.
/// Collective.
/// @param state at the start of the step @param h its length [s]
std::string beyond_reach(const Options& options, const Surface& surface, const ObjectState& state, double h);

/// What `work` returns, the result of a step or of its beginning, unless something is beyond reach: then a failed one,
/// without the work. Collective.
template <class Work>
auto within_reach(const Options& options, const Surface& surface, const ObjectState& state, double h,
                  const Work& work) {
  decltype(work()) step;
  step.reason = beyond_reach(options, surface, state, h);
  step.converged = step.reason.empty();
  return step.converged ? work() : step;
}

}  // namespace world
}  // namespace pellicle
