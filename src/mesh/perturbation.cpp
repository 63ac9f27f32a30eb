#include "mesh/perturbation.h"

#include <cstdint>

namespace pellicle {

namespace {

/// A uniform number in [-1, 1) for each (seed, id, component): SplitMix64's finaliser over their combination.
double noise(int seed, PetscInt id, int component) {
  auto bits = static_cast<std::uint64_t>(seed) * 0x9E3779B97F4A7C15ULL + static_cast<std::uint64_t>(id) * 3ULL +
              static_cast<std::uint64_t>(component);
  for (int round = 0; round < 2; ++round) {
    bits += 0x9E3779B97F4A7C15ULL;
    bits = (bits ^ (bits >> 30)) * 0xBF58476D1CE4E5B9ULL;
    bits = (bits ^ (bits >> 27)) * 0x94D049BB133111EBULL;
    bits ^= bits >> 31;
  }
  return static_cast<double>(bits >> 11) * 0x1.0p-52 - 1;
}

}  // namespace

Eigen::Matrix3Xd perturbed_positions(const PointSet& points, const SheetOptions& options, double mean_edge) {
  const double amplitude = options.perturbation * mean_edge;
  Eigen::Matrix3Xd positions = points.rest;
  for (Eigen::Index i = 0; i < positions.cols(); ++i) {
    for (int component = 0; component < 3; ++component) {
      positions(component, i) +=
          amplitude * noise(options.seed, points.persistent_id[static_cast<std::size_t>(i)], component);
    }
  }
  return positions;
}

}  // namespace pellicle
