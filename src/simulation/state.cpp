#include "simulation/state.h"

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

Snapshot::Snapshot(const State& state)
    : mass_burnt_(state.mass_burnt),
      heat_in_(state.heat_in),
      heat_out_(state.heat_out),
      position_(state.position.values()),
      velocity_(state.velocity.values()),
      temperature_(state.temperature.values()),
      mass_(state.mass.values()),
      mass_change_(state.mass_change.values()),
      target_length_(state.target_length),
      living_(state.living),
      pieces_(state.pieces),
      burn_time_(state.burn_time) {}

void Snapshot::restore(State& state) const {
  state.mass_burnt = mass_burnt_;
  state.heat_in = heat_in_;
  state.heat_out = heat_out_;
  state.position.values() = position_;
  state.velocity.values() = velocity_;
  state.temperature.values() = temperature_;
  state.mass.values() = mass_;
  state.mass_change.values() = mass_change_;
  state.target_length = target_length_;
  state.living = living_;
  state.pieces = pieces_;
  state.burn_time = burn_time_;
}

}  // namespace pellicle
