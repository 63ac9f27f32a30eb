#include "combustion/fire_front.h"

#include <algorithm>
#include <cmath>

namespace pellicle::combustion {

namespace {

double last_mass(const FrontInput& input, const CombustionOptions& options) {
  return std::max(input.loss_mass, options.min_mass);
}

}  // namespace

double heat_over_ignition(const FrontInput& input, const CombustionOptions& options) {
  const double m = last_mass(input, options);
  return input.burning_heat * (1 - m * m) / (2 * (options.ignition_temperature - input.ambient));
}

std::optional<FireFront> fire_front(const FrontInput& input, const CombustionOptions& options) {
  const double heat = heat_over_ignition(input, options);
  const double rate = options.mass_loss_rate * (options.corner_factor + options.lattice_factor) / 2;
  if (!(options.ignition_temperature > input.ambient && heat > 1 && input.diffusivity > 0 && rate > 0)) {
    return std::nullopt;
  }
  // The left side rises from 0 to infinity between s = 0 and 1.
  double low = 0;
  double high = 1;
  constexpr int halvings = 50;
  for (int n = 0; n < halvings; ++n) {
    const double s = (low + high) / 2;
    const double growth = s * (M_PI - std::acos(s)) / std::sqrt(1 - s * s);
    (2 * s * std::exp(growth) < heat - 1 ? low : high) = s;
  }
  const double mean_heat = input.burning_heat * (1 + last_mass(input, options)) / 2;
  const double speed = (low + high) * std::sqrt(input.diffusivity * mean_heat * rate);
  return FireFront{speed, input.diffusivity / speed};
}

}  // namespace pellicle::combustion
