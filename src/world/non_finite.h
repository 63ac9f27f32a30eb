#pragma once

#include <mpi.h>

#include <cstddef>
#include <string>
#include <vector>

#include "state/field_registry.h"

namespace pellicle {
inline namespace world {

/// Numbers of a state under one name.
struct NamedValues {
  const char* name;
  const double* values;
  std::size_t count;
};

/// Looks for the results of overflow, or of a solver that diverged. Collective.
/// @param quantities what this rank holds of each; the same names in the same order on every rank
/// @returns "the velocity is not finite" for the first one of which some rank holds such a number; "" if there is none
std::string non_finite(MPI_Comm comm, const std::vector<NamedValues>& quantities);

/// Sets to 0 what is not finite in a state, so that it can be drawn. Collective. @returns whether there was any
bool make_finite(MPI_Comm comm, const FieldRegistry& state);

}  // namespace world
}  // namespace pellicle
