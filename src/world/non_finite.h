#pragma once

#include <mpi.h>

#include <string>

#include "state/field_registry.h"

namespace pellicle {
inline namespace world {

/// Looks in a state for the results of overflow, or of a solver that diverged. Collective.
/// @returns "the velocity is not finite" for the first field of which some rank holds such a number; "" if there is
/// none
std::string non_finite(MPI_Comm comm, const FieldRegistry& state);

/// Sets values of a state that are not finite to 0, so that it can be drawn. Collective. @returns whether there were
/// any
bool make_finite(MPI_Comm comm, const FieldRegistry& state);

}  // namespace world
}  // namespace pellicle
