#pragma once

#include <mpi.h>

#include <string>

#include "state/field_registry.h"
#include "world/options.h"
#include "world/state.h"

namespace pellicle::world {

/// Tells in words of something that would move, or turn, so far in the next step that neither contact nor a balance of
/// forces could follow: a vertex by its velocity, gravity or the wind, or pins and bodies that a deck leads along a
/// path. Empty: nothing does. Collective.
/// @param state at the start of the step @param h its length [s]
std::string beyond_reach(const Options& options, const Surface& surface, const State& state, double h);

/// Looks in a state for the results of overflow, or of a solver that diverged. Collective.
/// @returns "the velocity is not finite" for the first field of which some rank holds such a number; "" if there is
/// none
std::string non_finite(MPI_Comm comm, const FieldRegistry& state);

/// Sets values of a state that are not finite to 0, so that it can be drawn. Collective. @returns whether there were
/// any
bool make_finite(MPI_Comm comm, const FieldRegistry& state);

}  // namespace pellicle::world
