#include "surface/active_set.h"

namespace pellicle {
inline namespace surface {

ActiveSet::ActiveSet(const Surface& surface)
    : triangles(surface.triangles.size(), true),
      cracked(static_cast<std::size_t>(surface.sides_per_element() * surface.elements.local()), false) {
  for (const Colour colour : all_colours) {
    springs[static_cast<std::size_t>(colour)].assign(surface.of(colour).ends.size(), true);
  }
}

std::vector<bool> particles_with_springs(const Surface& surface, const ActiveSet& active) {
  std::vector<bool> result(surface.particles.local(), false);
  for (const Colour colour : all_colours) {
    const std::vector<std::array<PetscInt, 2>>& ends = surface.of(colour).ends;
    const std::vector<bool>& lives = active.springs[static_cast<std::size_t>(colour)];
    for (std::size_t s = 0; s < ends.size(); ++s) {
      if (lives[s]) {
        result[ends[s][0]] = true;
        result[ends[s][1]] = true;
      }
    }
  }
  return result;
}

}  // namespace surface
}  // namespace pellicle
