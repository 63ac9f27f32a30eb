#include "world/burning_fields.h"

#include <algorithm>
#include <string>

#include "world/fire_remarks.h"

namespace pellicle::world {

BurningFields::BurningFields(FieldRegistry& registry, const Surface& surface)
    : temperature(registry.add<Field>({"temperature", "K", Item::particle, Drawn::of_both_layers})),
      mass(registry.add<Field>({"mass", "kg", Item::particle, Drawn::no, false, true})),
      mass_change(registry.add<Field>({"mass_change", "kg", Item::particle, Drawn::no, false, true})),
      pieces(registry.own<Pieces>()),
      burn_time(registry.add<std::vector<double>>({"burn_time", "s", Item::cell, Drawn::yes})),
      active(registry.own<ActiveSet>(surface)),
      mass_burnt(registry.add<double>({"mass_burnt", "kg", Item::sum})),
      cracked_sides(registry.add<double>({"cracked_sides", "", Item::sum})),
      crack_length(registry.add<double>({"crack_length", "m", Item::sum})),
      heat_initial(registry.add<double>({"heat_initial", "J", Item::sum})),
      heat_in(registry.add<double>({"heat_in", "J", Item::sum})),
      heat_out(registry.add<double>({"heat_out", "J", Item::sum})),
      heat_made(registry.add<double>({"heat_made", "J", Item::sum})),
      fire_record(registry.add<Eigen::VectorXd>({"fire_record", "", Item::object}, 4)) {
  fire_record = FireRecord().numbers();
  registry.declare({"piece", "", Item::particle}, pieces.of_particle);
  registry.declare({"pieces_present", "", Item::object}, pieces.present);
  registry.declare({"pieces_birth_time", "s", Item::object}, pieces.birth_time);
  registry.declare({"pieces_next_id", "", Item::object}, pieces.next_id);
  registry.declare({"living_triangles", "", Item::cell}, active.triangles, surface.triangles_per_element);
  registry.declare({"cracked", "", Item::cell}, active.cracked, surface.sides_per_element());
  for (const Colour colour : all_colours) {
    const auto index = static_cast<std::size_t>(colour);
    registry.declare({std::string("living_springs_") + colour_names[index], "", Item::spring, Drawn::no, true},
                     active.springs[index]);
  }
  mass.values() = Eigen::Map<const Eigen::RowVectorXd>(surface.initial_mass.data(), mass.values().cols());
  pieces.of_particle.assign(surface.particles.local(), -1);
  std::fill(burn_time.begin(), burn_time.end(), -1);
}

}  // namespace pellicle::world
