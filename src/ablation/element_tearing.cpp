#include "ablation/element_tearing.h"

#include <algorithm>
#include <cstdint>

#include "ablation/tearing.h"
#include "base/noise.h"

namespace pellicle {
inline namespace ablation {

ElementTearing::ElementTearing(const Surface& surface, const AblationOptions& options,
                               const std::vector<double>& texture)
    : surface_(surface), char_strength_(options.char_strength), largest_overload_(surface.particles, 1) {
  for (std::size_t e = 0; e < surface.triangles.size(); ++e) {
    double factor = 0;
    for (const PetscInt vertex : surface.triangles[e]) {
      factor += (texture.empty() ? 1 : texture[static_cast<std::size_t>(vertex)]) / 3;
    }
    const double random = noise(options.seed, static_cast<std::uint64_t>(surface.element_id[e]));
    unburnt_strength_.push_back(options.strength.value() * (1 + options.strength_scatter * random) * factor);
  }
}

std::vector<PetscInt> ElementTearing::torn(const std::vector<double>& tension, const Living& living, const Field& mass,
                                           double min_mass) {
  std::vector<double> overload(tension.size(), 0);
  largest_overload_.values().setZero();
  for (std::size_t e = 0; e < overload.size(); ++e) {
    if (!living.triangles[e]) {
      continue;
    }
    double share = 0;
    for (const PetscInt vertex : surface_.triangles[e]) {
      const double left = mass.data()[vertex] / surface_.initial_mass[static_cast<std::size_t>(vertex)];
      share += share_of_strength(left, min_mass, char_strength_) / 3;
    }
    overload[e] = tension[e] / (unburnt_strength_[e] * share);
    for (const PetscInt vertex : surface_.triangles[e]) {
      double& largest = largest_overload_.data()[vertex];
      largest = std::max(largest, overload[e]);
    }
  }
  // All elements at an owned particle are local.
  largest_overload_.update_ghosts();
  // What differs by rounding alone is equal, or the number of ranks would decide which tears.
  const double tie = 1 + 1e-6;
  std::vector<PetscInt> torn;
  for (PetscInt e = 0; e < surface_.elements.owned; ++e) {
    const auto& [a, b, c] = surface_.triangles[static_cast<std::size_t>(e)];
    const double* largest = largest_overload_.data();
    const double here = overload[static_cast<std::size_t>(e)];
    if (here > 1 && here * tie >= std::max({largest[a], largest[b], largest[c]})) {
      torn.push_back(e);
    }
  }
  return torn;
}

}  // namespace ablation
}  // namespace pellicle
