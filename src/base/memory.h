#pragma once

#include <string>

namespace pellicle {
inline namespace base {

/// Memory that this process may still take [bytes]: what the machine has to give, and no more than a control group or
/// `ulimit -v` leaves. Not collective.
double available_memory();

/// Refuses what would not fit in memory before any of it is allocated. Not collective.
/// @param what needs it, as the beginning of the message: "a rectangle of 9 x 9 cells"
/// @param bytes that it needs
/// @throws Error "WHAT needs about 4e+09 GB of memory, expected no more than the 12 GB that are available"
void require_memory(const std::string& what, double bytes);

}  // namespace base
}  // namespace pellicle
