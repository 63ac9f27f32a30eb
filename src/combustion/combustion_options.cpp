#include "combustion/combustion_options.h"

#include "options/options.h"

namespace pellicle::combustion {

void describe(OptionTable& table, CombustionOptions& options) {
  table.add("combustion.ignition_temperature", options.ignition_temperature, Rules("K").at_least(0),
            "above this temperature a particle loses mass", "burning paper, eq. 4; docs/theory.md: parameters");
  table.add("combustion.mass_loss_rate", options.mass_loss_rate, Rules("1/(K s)").at_least(0),
            "mu: the fraction of the initial mass lost per second and kelvin above ignition; 0: nothing burns",
            "burning paper, eq. 4; docs/theory.md: parameters");
  table.add("combustion.mass_loss_texture", options.mass_loss_texture, Rules().file(),
            "image whose brightness at the uv coordinates weights the mass-loss rate of each particle",
            "burning paper, section 8");
  table.add(
      "combustion.mass_loss_range", options.mass_loss_range,
      Rules().length(2).at_least(0).acts_with(is_given("combustion.mass_loss_texture", options.mass_loss_texture)),
      "factors on the mass-loss rate where the image is black and where it is white", "docs/theory.md: parameters");
  table.add("combustion.corner_factor", options.corner_factor, Rules().at_least(0),
            "factor on the mass-loss rate of the corner points, the blue layer", "burning paper, Fig. 7c");
  table.add("combustion.lattice_factor", options.lattice_factor, Rules().at_least(0),
            "factor on the mass-loss rate of the lattice points, the green layer", "burning paper, Fig. 7c");
  table.add("combustion.min_mass", options.min_mass, Rules().range(1e-3, 1),
            "the least mass that a particle can have, as a fraction of its initial mass",
            "burning paper, section 6; docs/theory.md: parameters");
  table.add("combustion.initial_density", options.initial_density, Rules("kg/m^3").more_than(0),
            "density of the unburnt material; only its ratio to the burnt density matters", "office paper");
  table.add("combustion.burnt_density", options.burnt_density, Rules("kg/m^3").more_than(0),
            "density of what is left at the least mass", "burning paper, eq. 5; docs/theory.md: parameters");
  table.add("combustion.char_stiffness", options.char_stiffness, Rules().more_than(0),
            "factor on the elastic energy of a balloon's wall at the least mass; in between it is linear in the mass; "
            "1: char is as stiff as the wall",
            "docs/theory.md: readings");
}

}  // namespace pellicle::combustion
