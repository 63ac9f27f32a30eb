#include "world/state.h"

#include <algorithm>
#include <string>

#include "parallel/collective.h"

namespace pellicle::world {

namespace {

/// Mass and heat that the gas in chambers has exchanged.
GasExchange& add_gas(FieldRegistry& state, int chambers, int links) {
  auto& gas = state.own<GasExchange>(chambers, links);
  state.declare({"gas_amount", "mol", Item::object}, gas.amount, chambers);
  state.declare({"gas_heat", "mol K", Item::object}, gas.heat, chambers);
  state.declare({"gas_open", "", Item::object}, gas.open, chambers);
  state.declare({"leak_amount", "mol", Item::object}, gas.leak_amount, chambers);
  state.declare({"leak_enthalpy", "J", Item::object}, gas.leak_enthalpy, chambers);
  state.declare({"gas_wall_heat", "J", Item::object}, gas.wall_heat, chambers);
  state.declare({"gas_work", "J", Item::object}, gas.work, chambers);
  state.declare({"link_amount", "mol", Item::object}, gas.link_amount, links);
  state.declare({"link_enthalpy", "J", Item::object}, gas.link_enthalpy, links);
  state.declare({"gas_first_energy", "J", Item::object}, gas.first_energy, chambers);
  state.declare({"gas_last_volume", "m^3", Item::object}, gas.volume, chambers);
  state.declare({"gas_inside", "", Item::object}, gas.inside, chambers);
  state.declare({"gas_outside", "", Item::object}, gas.outside, chambers);
  state.declare({"gas_parent", "", Item::object}, gas.parent, chambers);
  state.declare({"gas_reference_volume", "m^3", Item::object}, gas.reference_volume, chambers);
  return gas;
}

}  // namespace

State::State(const Surface& surface, const Options& options, int chambers)
    : FieldRegistry(surface.particles, {surface.elements.owned, surface.elements.local()}),
      target_length(own<TargetLengths>()),
      thickness_ratio(own<std::vector<double>>()),
      record(own<Eigen::VectorXd>()) {
  position.values() = surface.rest;
  std::fill(pin.begin(), pin.end(), -1);
  std::fill(chamber.begin(), chamber.end(), -1);
  const bool is_wall = !surface.has_quads();
  if (is_wall) {
    thickness_ratio.assign(chamber.size(), 1.0);
    declare({"thickness_ratio", "", Item::cell, Drawn::yes}, thickness_ratio);
    record.setZero(kinds_of_step_record);
    declare({"step_record", "", Item::object}, record, kinds_of_step_record);
  } else {
    burning.emplace(*this, surface);
    for (const Colour colour : all_colours) {
      target_length[colour] = surface.of(colour).initial_length;
      declare({std::string("target_length_") + colour_names[colour], "m", Item::spring, Drawn::no, true},
              target_length[colour]);
    }
    record.setZero(5);
    record[0] = -1;
    declare({"strain_record", "", Item::object}, record, static_cast<int>(record.size()));
  }
  pressure.setZero(chambers);
  declare({"pressure", "Pa", Item::object}, pressure, chambers);
  if (balloon_burns(options)) {
    burning.emplace(*this, surface);
  }
  if (const std::size_t count = options.attachments.size() + options.forces.size(); is_wall && count > 0) {
    loads = &add<std::vector<bool>>({"loads", "", Item::particle}, static_cast<int>(count));
  }
  if (options.time.scheme == TimeScheme::generalized_alpha) {
    acceleration = &add<Field>({"acceleration", "m/s^2", Item::particle}, 3);
  }
  if (follows_path(options.time)) {
    load_time = &add<double>({"load_time", "s", Item::object});
    direction = &add<Field>({"path_direction", "", Item::particle}, 3);
  }
  if (gas_is_joined(options)) {
    gas = &add_gas(*this, chambers, static_cast<int>(options.gas.links.size()));
  }
}

double kinetic_energy(const Surface& surface, const double* mass, const Field& velocity) {
  double sum = 0;
  for (PetscInt i = 0; i < surface.particles.owned; ++i) {
    sum += mass[i] / 2 * velocity.vector(i).squaredNorm();
  }
  return sum_over_ranks(surface.comm(), sum);
}

Records packed(const FieldRegistry& state, Item item, PetscInt owned) {
  Records records(state.record_size(item), owned);
  for (PetscInt i = 0; i < owned; ++i) {
    state.pack(item, i, records.at(i));
  }
  return records;
}

}  // namespace pellicle::world
