#include "surface/sheet.h"

#include <algorithm>
#include <array>

namespace pellicle::surface {

std::vector<double> corner_masses(const Sheet& sheet, const Field& mass) {
  Field sum(sheet.particles, 1);
  sum.values() = mass.values();
  const auto has_left = [&mass](PetscInt corner) { return mass.data()[corner] == 0; };
  for (std::size_t cell = 0; cell < sheet.cells.size(); ++cell) {
    const std::array<PetscInt, 4>& corners = sheet.cells[cell];
    sum.data()[sheet.lattice[cell]] = 0;
    const auto left = std::count_if(corners.begin(), corners.end(), has_left);
    for (const PetscInt corner : corners) {
      if (!has_left(corner)) {
        sum.data()[corner] += mass.data()[sheet.lattice[cell]] / static_cast<double>(4 - left);
      }
    }
  }
  // All elements at an owned corner are local; a ghost misses some.
  sum.update_ghosts();
  return {sum.data(), sum.data() + sheet.particles.local()};
}

void follow_corners(const Sheet& sheet, Field& values) {
  for (std::size_t cell = 0; cell < sheet.cells.size(); ++cell) {
    const auto& [a, b, c, d] = sheet.cells[cell];
    values.vector(sheet.lattice[cell]) =
        (values.vector(a) + values.vector(b) + values.vector(c) + values.vector(d)) / 4;
  }
}

}  // namespace pellicle::surface
