#pragma once

#include <string>

#include "surface/surface.h"
#include "world/options.h"
#include "world/state.h"

namespace pellicle {
inline namespace world {

/// Tells in words of something that would move, or turn, so far in the next step that neither contact nor a balance of
/// forces could follow: a vertex by its velocity, gravity or the wind, or pins and bodies that a deck leads along a
/// path. Empty: nothing does. Collective.
/// @param state at the start of the step @param h its length [s]
std::string beyond_reach(const Options& options, const Surface& surface, const State& state, double h);

}  // namespace world
}  // namespace pellicle
