#include "world/state_checks.h"

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
