#include "world/state.h"

#include <algorithm>
#include <string>

namespace pellicle {

State::State(const Sheet& sheet)
    : ObjectState(sheet.particles, {sheet.owned_cells, static_cast<PetscInt>(sheet.cells.size())}),
      pieces(own<Pieces>()),
      living(own<Living>(sheet)),
      target_length(own<TargetLengths>()) {
  declare({"piece", "", Item::particle}, pieces.of_particle);
  declare({"pieces_present", "", Item::object}, pieces.present);
  declare({"pieces_birth_time", "s", Item::object}, pieces.birth_time);
  declare({"pieces_next_id", "", Item::object}, pieces.next_id);
  declare({"living_triangles", "", Item::cell}, living.triangles, 4);
  for (const Colour colour : all_colours) {
    const auto index = static_cast<std::size_t>(colour);
    target_length[index] = sheet.of(colour).initial_length;
    const std::string name = colour_names[index];
    declare({"living_springs_" + name, "", Item::spring, Drawn::no, true}, living.springs[index]);
    declare({"target_length_" + name, "m", Item::spring, Drawn::no, true}, target_length[index]);
  }
  position.values() = sheet.rest;
  mass.values() = Eigen::Map<const Eigen::RowVectorXd>(sheet.initial_mass.data(), mass.values().cols());
  pieces.of_particle.assign(static_cast<std::size_t>(sheet.particles.local()), -1);
  std::fill(pin.begin(), pin.end(), -1);
  std::fill(burn_time.begin(), burn_time.end(), -1);
}

}  // namespace pellicle
