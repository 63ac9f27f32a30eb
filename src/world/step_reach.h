#pragma once

#include <string>

#include "surface/surface.h"
#include "world/object_state.h"
#include "world/options.h"

namespace pellicle {
inline namespace world {

/// Tells in words of something that would move, or turn, so far in the next step that neither contact nor a balance of
/// forces could follow: a vertex by its velocity, gravity or the wind, or what a deck leads along a path. Empty:
/// nothing does. Collective.
/// @param state at the start of the step @param h its length [s]
std::string beyond_reach(const Options& options, const Surface& surface, const ObjectState& state, double h);

/// Does the work of a step, or of its beginning, and returns its result. If something is beyond reach the work is not
/// done, and the result is that of a failed step. Collective.
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
