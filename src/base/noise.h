#pragma once

#include <cstdint>

namespace pellicle {
inline namespace base {

/// A uniform number in [-1, 1) that depends on seed and number alone, so that it is the same on every rank.
double noise(int seed, std::uint64_t number);

}  // namespace base
}  // namespace pellicle
