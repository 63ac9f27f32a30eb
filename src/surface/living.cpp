#include "surface/living.h"

namespace pellicle {

Living::Living(const Sheet& sheet) : triangles(4 * sheet.cells.size(), true) {
  for (const Colour colour : all_colours) {
    springs[static_cast<std::size_t>(colour)].assign(sheet.of(colour).ends.size(), true);
  }
}

std::vector<bool> particles_with_springs(const Sheet& sheet, const Living& living) {
  std::vector<bool> result(static_cast<std::size_t>(sheet.particles.local()), false);
  for (const Colour colour : all_colours) {
    const std::vector<std::array<PetscInt, 2>>& ends = sheet.of(colour).ends;
    const std::vector<bool>& lives = living.springs[static_cast<std::size_t>(colour)];
    for (std::size_t s = 0; s < ends.size(); ++s) {
      if (lives[s]) {
        result[static_cast<std::size_t>(ends[s][0])] = true;
        result[static_cast<std::size_t>(ends[s][1])] = true;
      }
    }
  }
  return result;
}

}  // namespace pellicle
