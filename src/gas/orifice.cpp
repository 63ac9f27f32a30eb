#include "gas/orifice.h"

#include <algorithm>
#include <cmath>

#include "gas/gas_options.h"

namespace pellicle {
inline namespace gas {

OrificeFlow orifice_flow(double area, double upstream, double downstream, double temperature, double gamma,
                         double molar_mass) {
  OrificeFlow result;
  if (!(upstream > 0)) {
    return result;
  }
  constexpr double least_drop = 1e-6;  // 1 - r, below which the flow is in proportion to it
  const double drop = std::min((upstream - downstream) / upstream, 1.0);
  const double choked = gamma / (gamma - 1) * std::log(2 / (gamma + 1));
  const double log_ratio = std::max(std::log1p(-std::max(drop, least_drop)), choked);
  // f(r) = sqrt(2 g/(g - 1) r^(2/g) (1 - r^((g - 1)/g))) and r df/dr.
  const double lost = -std::expm1((gamma - 1) / gamma * log_ratio);
  double shape = std::sqrt(2 * gamma / (gamma - 1) * std::exp(2 / gamma * log_ratio) * lost);
  double slope = shape * (1 / gamma - (gamma - 1) / (2 * gamma) * (1 - lost) / lost);
  if (log_ratio == choked) {
    slope = 0;
  } else if (drop < least_drop) {
    slope = -shape / least_drop * (1 - drop);
    shape *= drop / least_drop;
  }
  const double scale = area / std::sqrt(molar_mass * gas_constant * temperature);
  result.flow = scale * upstream * shape;
  result.by_upstream = scale * (shape - slope);
  result.by_downstream = downstream > 0 ? scale * slope * upstream / downstream : 0;
  result.by_temperature = -result.flow / (2 * temperature);
  return result;
}

double jet_thrust(double upstream, double downstream, double gamma) {
  if (!(upstream > downstream)) {
    return 0;
  }
  const double choked = std::pow(2 / (gamma + 1), gamma / (gamma - 1));
  const double outlet = std::max(downstream, choked * upstream);
  const double squared_mach = 2 / (gamma - 1) * std::expm1((gamma - 1) / gamma * std::log(upstream / outlet));
  return gamma * outlet * squared_mach + outlet - downstream;
}

}  // namespace gas
}  // namespace pellicle
