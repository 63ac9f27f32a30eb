#pragma once

#include <cmath>

#include "prism/material.h"

namespace pellicle {

/// Pressure in a thin spherical balloon whose radius is `stretch` times the undeformed one. The wall keeps its volume,
/// except for St. Venant-Kirchhoff, which is in plane stress. [Pa]
/// @param slenderness undeformed thickness over undeformed radius
inline double sphere_pressure(const Material& material, double slenderness, double stretch) {
  const std::string& law = law_of(material).name;
  if (law == "st_venant_kirchhoff") {
    const double young = material.mu * (3 * material.lambda + 2 * material.mu) / (material.lambda + material.mu);
    const double poisson = material.lambda / (2 * (material.lambda + material.mu));
    return slenderness * young / (1 - poisson) * (stretch - 1 / stretch);
  }
  if (law == "neo_hookean") {
    return 2 * slenderness * material.mu * (1 / stretch - std::pow(stretch, -7));
  }
  if (law == "mooney_rivlin") {
    return 4 * slenderness * (1 / stretch - std::pow(stretch, -7)) * (material.c1 + material.c2 * stretch * stretch);
  }
  double sum = 0;
  for (std::size_t k = 0; k < material.ogden_mu.size(); ++k) {
    const double alpha = material.ogden_alpha[k];
    sum += material.ogden_mu[k] * (std::pow(stretch, alpha - 3) - std::pow(stretch, -2 * alpha - 3));
  }
  return 2 * slenderness * sum;
}

/// The stretch between two at which the pressure has its only maximum or minimum there: the limit point.
inline double extremal_stretch(const Material& material, double from, double to) {
  const auto slope = [&material](double stretch) {
    constexpr double step = 1e-5;
    return sphere_pressure(material, 1, stretch + step) - sphere_pressure(material, 1, stretch - step);
  };
  const bool rises_first = slope(from) > 0;
  while (to - from > 1e-9) {
    const double middle = (from + to) / 2;
    ((slope(middle) > 0) == rises_first ? from : to) = middle;
  }
  return from;
}

}  // namespace pellicle
