#pragma once

#include <string>

#include "base/namespaces.h"

namespace pellicle::base {

/// Memory that this process may still take [bytes]: the machine's available memory, within the limits of control group
/// and `ulimit -v`. Not collective.
double available_memory();

/// Checks that something fits in memory before it is allocated. Not collective.
/// @param what name of the thing, which begins the message: "a rectangle of 9 x 9 cells"
/// @param bytes needed
/// @throws Error "WHAT needs about 4e+09 GB of memory, expected no more than the 12 GB that are available"
void require_memory(const std::string& what, double bytes);

}  // namespace pellicle::base
