#include "mesh/living.h"

namespace pellicle {

Living::Living(const Sheet& sheet) : triangles(4 * sheet.cells.size(), true) {
  for (const Colour colour : all_colours) {
    springs[static_cast<std::size_t>(colour)].assign(sheet.of(colour).ends.size(), true);
  }
}

}  // namespace pellicle
