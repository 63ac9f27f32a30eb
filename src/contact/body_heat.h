#pragma once

#include <Eigen/Core>
#include <vector>

#include "contact/bodies.h"
#include "parallel/field.h"
#include "surface/active_set.h"
#include "surface/surface.h"

namespace pellicle::contact {

/// Data of a step for the heat exchange with bodies.
struct BodyHeatInput {
  const Field& positions;   ///< at the start of the step, ghosts up to date [m]
  const Field& mass;        ///< ghosts up to date [kg]
  const ActiveSet& active;  ///< triangles that have not burnt, ghosts up to date
  double time = 0;          ///< at the start of the step [s]
  double h = 0;             ///< [s]
  double capacity = 0;      ///< c [J/(kg K)]
  double resting_gap = 0;   ///< gap beyond the margin at which the surface comes to rest on bodies [m]
};

/// Heat that owned particles have received, and given [J].
struct BodyHeat {
  double gained = 0;
  double lost = 0;
};

/// The conductance between a body at input.time and each owned particle [W/K]: the integral over the surface triangles
/// of the body's heat transfer coefficient, times a weight of the gap beyond the margin, times the fraction of the
/// particle.
///
/// The weight is 1 up to the gap `resting_gap` and falls from there to 0 over the body's `heat_reach` r, as
/// 1 - 10 s^3 + 15 s^4 - 6 s^5 where s = (gap - resting_gap)/r: heat depends neither on where in the zone of contact
/// the surface rests nor on how its triangles fit to the body. Triangles over which the gap changes by more than a part
/// of r are divided until it does not. In a sheet of two layers the nearer of them counts.
///
/// The fractions of the points of a surface triangle with the barycentric coordinates a, b, c are a, b, c; where c is
/// the centre of a quad, a (1 - c), b (1 - c), c (2 - c), whose integrals are the point_shares of mass and area. What
/// the four corners of a quad get is divided among them so that, where the weight is 1, each gets a quarter of it. So
/// what is heated evenly gets evenly hotter, on any mesh. Not collective.
Eigen::VectorXd body_conductance(const Surface& surface, const Body& body, const BodyHeatInput& input);

/// Heat exchange of a surface with bodies: a particle's temperature approaches the body's by the fraction 1 - exp(-G
/// h/(m c)), with its conductance G. Bodies without a temperature exchange none. Collective.
BodyHeat exchange_with_bodies(Field& temperature, const Surface& surface, const std::vector<Body>& bodies,
                              const BodyHeatInput& input);

/// Whether any of the bodies has a temperature.
bool exchange_heat(const std::map<std::string, BodyOptions>& bodies);

}  // namespace pellicle::contact
