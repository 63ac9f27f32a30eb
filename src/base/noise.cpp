#include "base/noise.h"

namespace pellicle {
inline namespace base {

double noise(int seed, std::uint64_t number) {
  // SplitMix64's finaliser, applied to both combined.
  std::uint64_t bits = static_cast<std::uint64_t>(seed) * 0x9E3779B97F4A7C15ULL + number;
  for (int round = 0; round < 2; ++round) {
    bits += 0x9E3779B97F4A7C15ULL;
    bits = (bits ^ (bits >> 30)) * 0xBF58476D1CE4E5B9ULL;
    bits = (bits ^ (bits >> 27)) * 0x94D049BB133111EBULL;
    bits ^= bits >> 31;
  }
  return static_cast<double>(bits >> 11) * 0x1.0p-52 - 1;
}

}  // namespace base
}  // namespace pellicle
