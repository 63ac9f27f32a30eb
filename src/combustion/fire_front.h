#pragma once

#include <optional>

#include "combustion/combustion_options.h"

namespace pellicle {
inline namespace combustion {

/// What the spread of a front depends on besides combustion.
struct FrontInput {
  double diffusivity = 0;   ///< alpha [m^2/s]
  double burning_heat = 0;  ///< eta [K]
  double ambient = 0;       ///< T_0 of what is not heated yet [K]
  double loss_mass = 0;     ///< m^loss, as a share of the initial mass
};

/// A front of fire that moves evenly.
struct FireFront {
  double speed = 0;  ///< [m/s]
  double width = 0;  ///< of what it heats ahead, alpha over the speed [m]
};

/// Heat that burns over the heat that brings the neighbours to ignition, E = eta (1 - m^2) / (2 (T_i - T_0)) with
/// m = max(m^loss, m^min): a front needs more than 1.
double heat_over_ignition(const FrontInput& input, const CombustionOptions& options);

/// The front that goes on by itself without losses of heat; nothing if none does. The moving front's equation
///
///     alpha T'' - c T' + mu eta' max(T - T_i, 0) = 0,    eta' = eta (1 + m)/2,
///
/// is solved by T - T_0 = (T_i - T_0) e^{c x/alpha} ahead, and behind up to where what can burn has burnt. With
/// s = c / (2 sqrt(alpha eta' mu)) the heat balance over it is 2 s exp(s (pi - acos s)/sqrt(1 - s^2)) = E - 1. Measured
/// fronts (docs/fire.md) go 1.1 to 1.2 times as fast, since what has lost mass conducts better.
std::optional<FireFront> fire_front(const FrontInput& input, const CombustionOptions& options);

}  // namespace combustion
}  // namespace pellicle
