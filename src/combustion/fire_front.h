#pragma once

#include <optional>

#include "combustion/combustion_options.h"

namespace pellicle::combustion {

/// Properties that determine a fire front, besides those of combustion.
struct FrontInput {
  double diffusivity = 0;   ///< alpha [m^2/s]
  double burning_heat = 0;  ///< eta [K]
  double ambient = 0;       ///< T_0 of the unheated sheet [K]
  double loss_mass = 0;     ///< m^loss, as a fraction of the initial mass
};

/// A fire front of constant speed.
struct FireFront {
  double speed = 0;  ///< [m/s]
  double width = 0;  ///< of the heated zone ahead, alpha over the speed [m]
};

/// Heat of burning over the heat that ignites the neighbours, E = eta (1 - m^2) / (2 (T_i - T_0)) with m = max(m^loss,
/// m^min): a front needs E > 1.
double heat_over_ignition(const FrontInput& input, const CombustionOptions& options);

/// The self-sustaining front without losses of heat, if there is one. The moving front's equation
///
///     alpha T'' - c T' + mu eta' max(T - T_i, 0) = 0,    eta' = eta (1 + m)/2,
///
/// is solved by T - T_0 = (T_i - T_0) e^{c x/alpha} ahead, and behind up to the end of burning. With s = c / (2
/// sqrt(alpha eta' mu)) the heat balance over it is 2 s exp(s (pi - acos s)/sqrt(1 - s^2)) = E - 1. Measured fronts
/// (docs/fire.md) are 1.1 to 1.2 times as fast, since material that has lost mass conducts better.
std::optional<FireFront> fire_front(const FrontInput& input, const CombustionOptions& options);

}  // namespace pellicle::combustion
