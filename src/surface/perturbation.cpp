#include "surface/perturbation.h"

#include <cstdint>

#include "base/noise.h"

namespace pellicle {
inline namespace surface {

Eigen::Matrix3Xd perturbed_positions(const Surface& points, const SheetOptions& options, double mean_edge) {
  const double amplitude = options.perturbation * mean_edge;
  Eigen::Matrix3Xd positions = points.rest;
  for (Eigen::Index i = 0; i < positions.cols(); ++i) {
    for (int component = 0; component < 3; ++component) {
      const auto id = static_cast<std::uint64_t>(points.persistent_id[i]);
      positions(component, i) += amplitude * noise(options.seed, 3 * id + static_cast<std::uint64_t>(component));
    }
  }
  return positions;
}

}  // namespace surface
}  // namespace pellicle
