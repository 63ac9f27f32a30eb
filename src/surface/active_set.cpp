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
  for_each_active_spring(surface, active, [&result](const std::array<PetscInt, 2>& ends) {
    result[ends[0]] = true;
    result[ends[1]] = true;
  });
  return result;
}

}  // namespace surface
}  // namespace pellicle
