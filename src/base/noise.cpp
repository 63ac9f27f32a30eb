#include "base/noise.h"

#include <cmath>

namespace pellicle::base {

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

namespace {

/// A normally distributed number of a point of the lattice of whole numbers (Box and Muller).
double normal_number(int seed, const Eigen::Vector3d& point) {
  constexpr double two_pi = 6.283185307179586;
  std::uint64_t number = 0;
  for (const double coordinate : point) {
    number = (number + static_cast<std::uint64_t>(static_cast<std::int64_t>(coordinate))) * 0xD1342543DE82EF95ULL;
  }
  const double first = (1 + noise(seed, number)) / 2;
  const double second = (1 + noise(seed, number + 1)) / 2;
  return std::sqrt(-2 * std::log(1 - first)) * std::cos(two_pi * second);
}

}  // namespace

double noise(int seed, const Eigen::Vector3d& place) {
  const Eigen::Vector3d corner = place.array().floor();
  const Eigen::Array3d t = place - corner;
  const Eigen::Array3d upper = t * t * (3 - 2 * t);
  double sum = 0;
  double squares = 0;
  for (int k = 0; k < 8; ++k) {
    const Eigen::Vector3d step(k & 1, (k >> 1) & 1, k >> 2);
    const double weight = (step.array() > 0).select(upper, 1 - upper).prod();
    if (weight > 0) {
      sum += weight * normal_number(seed, corner + step);
      squares += weight * weight;
    }
  }
  return std::erf(sum / std::sqrt(2 * squares));  // The normal distribution's share below sum / sqrt(squares), from -1.
}

}  // namespace pellicle::base
