#pragma once

#include <string>
#include <vector>

#include "options/choice.h"

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

}  // namespace pellicle::combustion
