#pragma once

#include <array>
#include <vector>

#include "combustion/combustion_options.h"
#include "parallel/field.h"
#include "surface/living.h"
#include "surface/sheet.h"

namespace pellicle {
inline namespace combustion {

/// Target lengths of the local springs of each colour [m].
using TargetLengths = std::array<std::vector<double>, 4>;

/// What the loss of mass in a step depends on.
struct BurnInput {
  const Field& temperature;                     ///< [K], ghosts up to date, (1 x local)
  const std::vector<double>& mass_loss_factor;  ///< on mu of each local particle, or empty for 1
  double time_step = 0;                         ///< h [s]
  const std::vector<bool>* can_burn = nullptr;  ///< local particles that can; null: all
};

/// One step of mass loss: dm = -mu h m^init max(T - T^ignition, 0) (burning paper, eq. 4), clamped so that the mass
/// neither grows nor falls below m^min. Not collective: ghosts burn alike.
/// @param mass [kg], ghosts up to date, (1 x local)
/// @param mass_change receives dm <= 0 [kg], (1 x local)
/// @returns the mass lost by the owned particles, at least 0 [kg].
double burn(Field& mass, Field& mass_change, const Surface& surface, const BurnInput& input,
            const CombustionOptions& options);

/// Share of what can burn that has, (m^init - m) / (m^init - m^min), in [0, 1].
/// @param mass_ratio m/m^init
double burnt_share(double mass_ratio, const CombustionOptions& options);

/// v = (m/rho) / (m^init/rho^init), in [0, 1] (burning paper, eq. 5). The density goes from the initial to the burnt
/// one linearly with the burnt share.
/// @param mass_ratio m/m^init
double volume_ratio(double mass_ratio, const CombustionOptions& options);

/// v of all local particles, > 0; a particle that has been removed, of mass 0, counts as one of the least mass. Not
/// collective.
/// @param mass [kg], ghosts up to date, (1 x local)
void set_volume_ratios(std::vector<double>& ratio, const Sheet& sheet, const Field& mass,
                       const CombustionOptions& options);

/// l = l^init (v_0 + v_1)/2 of all local springs (burning paper, eq. 6). Not collective.
/// @param ratio v of all local particles
void set_target_lengths(TargetLengths& lengths, const Sheet& sheet, const std::vector<double>& ratio);

/// The same for a sheet as a material, whose layers are one surface: where the layers shrink by different amounts, a
/// spring is without force at the mean of both. The length of a blue spring follows half from its own ends and half
/// from those of the green one that crosses it, and the other way round. Not collective.
/// @param living what has not burnt, ghosts up to date @param ratio v of all local particles
void set_surface_lengths(TargetLengths& lengths, const Sheet& sheet, const Living& living,
                         const std::vector<double>& ratio);

}  // namespace combustion
}  // namespace pellicle
