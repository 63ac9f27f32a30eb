#include "world/state.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <type_traits>

#include "base/units.h"
#include "geometry/key_points.h"
#include "geometry/pi.h"
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

/// How far a path or a velocity leads from one time to another [m]; the same of turns [rad].
double displacement(const Rows& path, const Eigen::Vector3d& velocity, double from, double to) {
  return (place_of_motion(path, velocity, to) - place_of_motion(path, velocity, from)).norm();
}

/// Diagonal of the undeformed surface's box, and the farthest that velocities and gravity alone carry an owned particle
/// in a step, both [m]. Collective.
std::array<double, 2> size_and_way(const Options& options, const Surface& surface, const State& state, double h) {
  Eigen::AlignedBox3d box;
  double way = 0;
  for (PetscInt i = 0; i < surface.particles.owned; ++i) {
    box.extend(surface.rest.col(i));
    const Eigen::Vector3d velocity = state.velocity.vector(i) + h * options.force.gravity;
    way = std::max(way, h * velocity.norm());
  }
  Eigen::Matrix<double, 7, 1> largest;
  largest << box.max(), -box.min(), way;
  max_over_ranks(surface.comm(), largest);
  const Eigen::Vector3d diagonal = largest.head<3>() + largest.segment<3>(3);
  return {diagonal.norm(), largest[6]};
}

/// Calls `visit` with each number of a field that is a double.
template <class Visit>
void for_each_double(const FieldRegistry::Entry& entry, const Visit& visit) {
  std::visit(
      [&visit](auto* values) {
        using Values = std::remove_pointer_t<decltype(values)>;
        if constexpr (std::is_same_v<Values, Field>) {
          std::for_each(values->data(), values->data() + values->values().size(), visit);
        } else if constexpr (std::is_same_v<Values, double>) {
          visit(*values);
        } else if constexpr (std::is_same_v<Values, std::vector<double>> || std::is_same_v<Values, Eigen::VectorXd>) {
          std::for_each(values->begin(), values->end(), visit);
        }
      },
      entry.storage);
}

}  // namespace

BurningFields::BurningFields(FieldRegistry& registry, const Surface& surface)
    : registry(registry), active(registry.own<ActiveSet>(surface)) {
  of(fire_record, FireRecord::last_time) = -1;
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

State::State(const Surface& surface, const Options& options, int chambers)
    : FieldRegistry(surface.particles, surface.elements.local()),
      target_length(own<TargetLengths>()),
      thickness_ratio(own<std::vector<double>>()),
      record(own<Eigen::VectorXd>()) {
  declare({"factorised_in_a_row", "", Item::object}, factorised_steps.in_a_row);
  declare({"factorised_left", "", Item::object}, factorised_steps.left);
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

std::string beyond_reach(const Options& options, const Surface& surface, const State& state, double h) {
  constexpr double most_sizes = 1000;
  const double from = state.time;
  const double to = from + h;
  const auto [size, of_vertices] = size_and_way(options, surface, state, h);
  // Negated, so that what is not a number is a fault, too.
  const auto too_far = [&](const std::string& what, double far) {
    return far <= most_sizes * size
               ? ""
               : what +
                     fmt::format(
                         " would move by {:.3g} m in the step, expected at most {:.3g} m, 1000 times the object's size",
                         far, most_sizes * size);
  };
  std::string words = too_far("a vertex", of_vertices);
  const auto look_at = [&](const std::string& key, const auto& objects) {
    for (const auto& [name, object] : objects) {
      if (words.empty()) {
        words = too_far(key + name, displacement(object.path, object.velocity, from, to));
      }
    }
  };
  look_at("pins.", options.pins);
  look_at("attachments.", options.attachments);
  look_at("bodies.", options.bodies);
  for (const auto& [name, body] : options.bodies) {
    const double turn = displacement(body.rotation, body.angular_velocity, from, to);
    if (words.empty() && !(turn <= pi)) {
      words =
          "bodies." + name + " would turn by " + number_text(turn) + " rad in the step, expected at most half a turn";
    }
  }
  if (words.empty() && options.force.air.density > 0 && !options.force.air.wind.velocity.empty()) {
    words =
        too_far("the air of force.wind.velocity", h * place_on_key_points(options.force.air.wind.velocity, to).norm());
  }
  return words;
}

std::string non_finite(MPI_Comm comm, const FieldRegistry& state) {
  const auto& entries = state.entries();
  const auto first = std::find_if(entries.begin(), entries.end(), [](const FieldRegistry::Entry& entry) {
    bool is_finite = true;
    for_each_double(entry, [&is_finite](double number) { is_finite = is_finite && std::isfinite(number); });
    return !is_finite;
  });
  const auto place = min_over_ranks(comm, static_cast<int>(first - entries.begin()));
  return place == static_cast<int>(entries.size()) ? "" : "the " + entries[place].declaration.name + " is not finite";
}

bool make_finite(MPI_Comm comm, const FieldRegistry& state) {
  bool found = false;
  const auto mend = [&found](double& number) {
    found = found || !std::isfinite(number);
    number = std::isfinite(number) ? number : 0;
  };
  for (const FieldRegistry::Entry& entry : state.entries()) {
    for_each_double(entry, mend);
  }
  return on_any_rank(comm, found);
}

}  // namespace pellicle::world
