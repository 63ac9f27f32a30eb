#pragma once

#include <mpi.h>

#include <cstddef>
#include <string>
#include <vector>

namespace pellicle {

/// Numbers of a state under one name.
struct NamedValues {
  const char* name;
  const double* values;
  std::size_t count;
};

/// Looks for what overflow, or a solver that went astray, leaves behind. Collective.
/// @param quantities what this rank holds of each; the same names in the same order on every rank
/// @returns "the velocity is not finite": the first of which some rank holds such a number; "" if there is none
std::string non_finite(MPI_Comm comm, const std::vector<NamedValues>& quantities);

}  // namespace pellicle
