#include "world/state.h"

namespace pellicle {

State::State(const Sheet& sheet)
    : position(sheet.particles, 3),
      velocity(sheet.particles, 3),
      temperature(sheet.particles, 1),
      mass(sheet.particles, 1),
      mass_change(sheet.particles, 1),
      living(sheet),
      burn_time(sheet.cells.size(), -1) {
  position.values() = sheet.rest;
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    mass.values()(0, i) = sheet.initial_mass[static_cast<std::size_t>(i)];
  }
  for (const Colour colour : all_colours) {
    target_length[static_cast<std::size_t>(colour)] = sheet.of(colour).initial_length;
  }
}

}  // namespace pellicle
