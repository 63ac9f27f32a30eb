#pragma once

#include <vector>

#include "contact/bodies.h"
#include "parallel/field.h"

namespace pellicle {
inline namespace contact {

/// Heat that bodies exchange with what touches them in a step.
struct BodyHeatInput {
  const Layout& particles;
  const Field& positions;       ///< at the start of the step [m]
  const Field& mass;            ///< [kg]
  const Eigen::VectorXd& area;  ///< of the owned particles [m^2]
  double time = 0;              ///< at the start of the step [s]
  double h = 0;                 ///< [s]
  double capacity = 0;          ///< c [J/(kg K)]
  double reach = 0;             ///< gap beyond the margin up to which a particle touches a body [m]
};

/// Heat that owned particles have received, and given [J].
struct BodyHeat {
  double gained = 0;
  double lost = 0;
};

/// The temperature T of what touches a body approaches the body's by the share 1 - exp(-k A h/(m c)), with the body's
/// heat transfer coefficient k and the particle's area A. Bodies without a temperature do nothing. Collective.
BodyHeat exchange_with_bodies(Field& temperature, const std::vector<Body>& bodies, const BodyHeatInput& input);

/// Whether any of the bodies has a temperature.
bool exchange_heat(const std::map<std::string, BodyOptions>& bodies);

}  // namespace contact
}  // namespace pellicle
