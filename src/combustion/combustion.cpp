#include "combustion/combustion.h"

#include <algorithm>
#include <cmath>

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

double burn(Field& mass, Field& mass_change, const Surface& surface, const BurnInput& input,
            const CombustionOptions& options) {
  double lost = 0;
  for (PetscInt i = 0; i < surface.particles.local(); ++i) {
    double rate = options.mass_loss_rate * (surface.is_lattice[i] ? options.lattice_factor : options.corner_factor);
    if (!input.mass_loss_factor.empty()) {
      rate *= input.mass_loss_factor[i];
    }
    const double excess = std::max(input.temperature.data()[i] - options.ignition_temperature, 0.0);
    const double before = mass.data()[i];
    const double least = std::min(before, options.min_mass * surface.initial_mass[i]);
    if (input.can_burn != nullptr && !(*input.can_burn)[i]) {
      rate = 0;
    }
    const double after = std::max(before - rate * input.time_step * surface.initial_mass[i] * excess, least);
    mass.data()[i] = after;
    mass_change.data()[i] = after - before;
    if (i < surface.particles.owned) {
      lost += before - after;
    }
  }
  return lost;
}

double burnt_share(double mass_ratio, const CombustionOptions& options) {
  return options.min_mass < 1 ? std::clamp((1 - mass_ratio) / (1 - options.min_mass), 0.0, 1.0) : 0.0;
}

double volume_ratio(double mass_ratio, const CombustionOptions& options) {
  const double density_ratio =
      1 + (options.burnt_density / options.initial_density - 1) * burnt_share(mass_ratio, options);
  return std::clamp(mass_ratio / density_ratio, 0.0, 1.0);
}

void set_volume_ratios(std::vector<double>& ratio, const Sheet& sheet, const Field& mass,
                       const CombustionOptions& options) {
  ratio.resize(sheet.particles.local());
  for (std::size_t i = 0; i < ratio.size(); ++i) {
    ratio[i] = volume_ratio(mass.data()[i] > 0 ? mass.data()[i] / sheet.initial_mass[i] : options.min_mass, options);
  }
}

void set_target_lengths(TargetLengths& lengths, const Sheet& sheet, const std::vector<double>& ratio) {
  for (const Colour colour : all_colours) {
    const SpringSet& springs = sheet.of(colour);
    std::vector<double>& length = lengths[static_cast<std::size_t>(colour)];
    length.resize(springs.ends.size());
    for (std::size_t s = 0; s < length.size(); ++s) {
      const auto [a, b] = springs.ends[s];
      length[s] = springs.initial_length[s] * 0.5 * (ratio[a] + ratio[b]);
    }
  }
}

void set_surface_lengths(TargetLengths& lengths, const Sheet& sheet, const ActiveSet& active,
                         const std::vector<double>& ratio) {
  set_target_lengths(lengths, sheet, ratio);
  const auto mean = [&ratio](PetscInt a, PetscInt b) { return (ratio[a] + ratio[b]) / 2; };
  for (const Colour colour : {Colour::green, Colour::blue}) {  // Springs of other colours join the layers.
    const SpringSet& springs = sheet.of(colour);
    for (std::size_t s = 0; s < springs.ends.size(); ++s) {
      double across = 0;
      int triangles = 0;
      for (const PetscInt triangle : springs.triangles[s]) {
        if (triangle >= 0 && active.triangles[triangle]) {
          const auto& [corner, next, lattice] = sheet.triangles[triangle];
          across += colour == Colour::blue ? ratio[lattice] : mean(corner, next);
          ++triangles;
        }
      }
      if (triangles > 0) {
        const auto [a, b] = springs.ends[s];
        lengths[static_cast<std::size_t>(colour)][s] =
            springs.initial_length[s] * ((mean(a, b) + across / triangles) / 2);
      }
    }
  }
}

std::optional<FireFront> fire_front(const FrontInput& input, const CombustionOptions& options) {
  const double m = std::max(input.loss_mass, options.min_mass);
  const double heat = input.burning_heat * (1 - m * m) / (2 * (options.ignition_temperature - input.ambient));
  const double rate = options.mass_loss_rate * (options.corner_factor + options.lattice_factor) / 2;
  if (!(options.ignition_temperature > input.ambient && heat > 1 && input.diffusivity > 0 && rate > 0)) {
    return std::nullopt;
  }
  // The left side rises from 0 to infinity between s = 0 and 1.
  double low = 0;
  double high = 1;
  constexpr int halvings = 50;
  for (int n = 0; n < halvings; ++n) {
    const double s = (low + high) / 2;
    const double growth = s * (M_PI - std::acos(s)) / std::sqrt(1 - s * s);
    (2 * s * std::exp(growth) < heat - 1 ? low : high) = s;
  }
  const double mean_heat = input.burning_heat * (1 + m) / 2;
  const double speed = (low + high) * std::sqrt(input.diffusivity * mean_heat * rate);
  return FireFront{heat, speed, input.diffusivity / speed};
}

}  // namespace pellicle::combustion
