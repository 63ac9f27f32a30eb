#include "combustion/combustion.h"

#include <algorithm>

namespace pellicle::combustion {

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

}  // namespace pellicle::combustion
