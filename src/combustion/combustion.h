#pragma once

#include <array>
#include <vector>

#include "combustion/combustion_options.h"
#include "parallel/field.h"
#include "surface/active_set.h"
#include "surface/sheet.h"

namespace pellicle::combustion {

/// Target lengths of the local springs of each colour [m].
using TargetLengths = std::array<std::vector<double>, 4>;

/// Data of a step for the loss of mass.
struct BurnInput {
  const Field& temperature;                     ///< [K], ghosts up to date, (1 x local)
  const std::vector<double>& mass_loss_factor;  ///< on mu of each local particle, or empty for 1
  double time_step = 0;                         ///< h [s]
  const std::vector<bool>* can_burn = nullptr;  ///< local particles that can burn; null: all
};

/// One step of mass loss: dm = -mu h m^init max(T - T^ignition, 0) (burning paper, eq. 4), clamped so that the mass
/// neither grows nor falls below m^min. Not collective: ghosts burn alike.
/// @param mass [kg], ghosts up to date, (1 x local)
/// @param mass_change receives dm <= 0 [kg], (1 x local)
/// @returns the mass lost by the owned particles, at least 0 [kg].
double burn(Field& mass, Field& mass_change, const Surface& surface, const BurnInput& input,
            const CombustionOptions& options);

/// Burnt fraction of the combustible mass, (m^init - m) / (m^init - m^min), in [0, 1].
/// @param mass_ratio m/m^init
double burnt_share(double mass_ratio, const CombustionOptions& options);

/// v = (m/rho) / (m^init/rho^init), in [0, 1] (burning paper, eq. 5). The density changes from the initial to the burnt
/// one linearly with the burnt share.
/// @param mass_ratio m/m^init
double volume_ratio(double mass_ratio, const CombustionOptions& options);

/// v of all local particles, > 0; removed particles, of mass 0, are treated as of the least mass. Not collective.
/// @param mass [kg], ghosts up to date, (1 x local)
void set_volume_ratios(std::vector<double>& ratio, const Sheet& sheet, const Field& mass,
                       const CombustionOptions& options);

/// l = l^init (v_0 + v_1)/2 of all local springs (burning paper, eq. 6). Not collective.
/// @param ratio v of all local particles
void set_target_lengths(TargetLengths& lengths, const Sheet& sheet, const std::vector<double>& ratio);

/// Target lengths for a sheet as a material, whose layers are one surface: where the layers shrink differently, a
/// spring has the mean of both as its length. So a blue spring's length follows half from its own ends and half from
/// those of the green one that crosses it, and conversely. Not collective.
/// @param active springs that have not burnt, ghosts up to date @param ratio v of all local particles
void set_surface_lengths(TargetLengths& lengths, const Sheet& sheet, const ActiveSet& active,
                         const std::vector<double>& ratio);

}  // namespace pellicle::combustion
