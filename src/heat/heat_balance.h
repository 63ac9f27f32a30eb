#pragma once

#include "heat/heat_options.h"
#include "parallel/field.h"
#include "surface/active_set.h"
#include "surface/surface.h"

namespace pellicle::heat {

/// sum c m_i T_i of the owned particles [J]; with a change of mass or temperature as argument, the change of heat. Not
/// collective: the caller sums over the ranks.
double heat_content(const Surface& surface, const Field& mass, const Field& temperature, double capacity);

/// Data of a step for heat sources, with ghosts up to date.
struct HeatSourceInput {
  const Surface& surface;
  const Field& positions;              ///< at the start of the step [m]
  const Field& mass;                   ///< [kg]
  const std::vector<double>& texture;  ///< value in [0, 1] at each local particle, of a texture
  double time = 0;                     ///< start of the step [s]
  double time_step = 0;                ///< h [s]
  double capacity = 0;                 ///< c [J/(kg K)]
};

/// One step of exchange with an active source, T^ext of eq. 1: T += f max(T_source - T, 0). The fraction f of a ball is
/// (1 - exp(-rate h)) (1 - (r/R)^2)^2 at distance r < R of its centre at the start of the step; that of a texture with
/// value v is 1 - exp(-rate v h). Particles of mass 0 have been removed. Not collective: ghosts are heated alike.
/// @returns the heat added to the owned particles [J].
double apply_heat_source(Field& temperature, const HeatSource& source, const HeatSourceInput& input);

/// Heat released by burning (burning paper, eq. 1 with the sign corrected): T -= eta dm / m^init, where dm <= 0 is the
/// mass change of the step before; particles of mass 0 have been removed. Not collective: ghosts are heated alike.
/// @returns the heat added to the owned particles [J].
double release_burning_heat(Field& temperature, const Surface& surface, const Field& mass_change, const Field& mass,
                            const HeatOptions& options);

/// Area of the surface that belongs to each owned particle [m^2], divided as the masses are: of a quad half to its
/// lattice particle and an eighth to each corner, of a triangle a third to each corner. Dead triangles are left out.
/// Not collective.
/// @param active triangles that have not burnt, ghosts up to date
Eigen::VectorXd particle_areas(const Surface& surface, const Field& positions, const ActiveSet& active);

/// Heat that the owned particles exchanged [J].
struct HeatExchange {
  double gained = 0;  ///< by those that grew warmer
  double lost = 0;    ///< by those that cooled, at least 0
};

/// Exchange with the surroundings on both sides by convection and radiation,
/// m c dT/dt = -2 A (h_c (T - T_amb) + epsilon sigma (T^4 - T_amb^4)), by the exponential midpoint rule: exact for
/// convection, second order for radiation, never beyond T_amb. Does nothing when both are off. Collective.
/// @param active triangles that have not burnt, ghosts up to date
HeatExchange exchange_with_surroundings(Field& temperature, const Surface& surface, const Field& positions,
                                        const Field& mass, const ActiveSet& active, double time_step,
                                        const HeatOptions& options);

}  // namespace pellicle::heat
