#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "options/choice.h"
#include "parallel/field.h"
#include "surface/active_set.h"
#include "surface/sheet.h"

namespace pellicle::combustion {

/// Loss of mass by burning and the resulting shrinkage (burning paper, section 6).
struct CombustionOptions {
  double ignition_temperature = 500;              ///< T^ignition [K]
  double mass_loss_rate = 0.02;                   ///< mu [1/(K s)]
  std::string mass_loss_texture;                  ///< file of an image that weights mu by particle; none when empty
  std::vector<double> mass_loss_range{0.2, 1.8};  ///< factors on mu at black and at white
  double corner_factor = 1;                       ///< on mu of the corner points
  double lattice_factor = 1;                      ///< on mu of the lattice points
  double min_mass = 0.3;                          ///< m^min, as a fraction of the initial mass
  double initial_density = 800;                   ///< rho of the unburnt material [kg/m^3]
  double burnt_density = 320;                     ///< rho at m^min [kg/m^3]
  double char_stiffness = 1;                      ///< fraction of a balloon's stiffness at m^min
};

/// Declares the options `combustion.*`.
void describe(OptionTable& table, CombustionOptions& options);

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

/// Properties that determine a fire front, besides those of combustion.
struct FrontInput {
  double diffusivity = 0;   ///< alpha [m^2/s]
  double burning_heat = 0;  ///< eta [K]
  double ambient = 0;       ///< T_0 of the unheated sheet [K]
  double loss_mass = 0;     ///< m^loss, as a fraction of the initial mass
};

/// A fire front of constant speed.
struct FireFront {
  double heat = 0;   ///< of burning over the heat that ignites the neighbours, E
  double speed = 0;  ///< [m/s]
  double width = 0;  ///< of the heated zone ahead, alpha over the speed [m]
};

/// The self-sustaining front without losses of heat, if there is one: it needs E > 1, where E = eta (1 - m^2) / (2 (T_i
/// - T_0)) with m = max(m^loss, m^min). The moving front's equation
///
///     alpha T'' - c T' + mu eta' max(T - T_i, 0) = 0,    eta' = eta (1 + m)/2,
///
/// is solved by T - T_0 = (T_i - T_0) e^{c x/alpha} ahead, and behind up to the end of burning. With s = c / (2
/// sqrt(alpha eta' mu)) the heat balance over it is 2 s exp(s (pi - acos s)/sqrt(1 - s^2)) = E - 1. Measured fronts
/// (docs/fire.md) are 1.1 to 1.2 times as fast, since material that has lost mass conducts better.
std::optional<FireFront> fire_front(const FrontInput& input, const CombustionOptions& options);

}  // namespace pellicle::combustion
