#include "constraints/pins.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <sstream>

#include "base/error.h"
#include "geometry/key_points.h"
#include "parallel/collective.h"
#include "parallel/exchange.h"

namespace pellicle::constraints {

namespace {

/// The condition of a name such as "min_x_max_y": for each axis the lowest end (-1), the highest (1), or neither (0).
std::array<int, 3> parse_ends(const std::string& name, const std::string& key) {
  std::array<int, 3> wanted{};
  if (name == "all") {
    return wanted;
  }
  std::istringstream words(name);
  std::string end;
  std::string axis;
  while (std::getline(words, end, '_')) {
    if (!std::getline(words, axis, '_') || (end != "min" && end != "max") || axis.size() != 1 || axis[0] < 'x' ||
        axis[0] > 'z') {
      throw Error(key + ": '" + name + "' names no corner, expected all, or ends such as max_y or min_x_max_y");
    }
    wanted[axis[0] - 'x'] = end == "min" ? -1 : 1;
  }
  return wanted;
}

/// Pin of each local particle, or -1. Collective. @throws Error as the constructor of Pins does
std::vector<PetscInt> selected(const Surface& points, const std::map<std::string, PinOptions>& options) {
  std::vector<PetscInt> numbers(points.particles.local(), -1);
  PetscInt pin = 0;
  for (const auto& [name, given] : options) {
    const std::string key = "pins." + name;
    refuse_fault(key, fault_of_motion(given.path, given.velocity));
    const std::vector<bool> chosen = select(points, key, given);
    together(points.comm(), [&] {
      for (PetscInt i = 0; i < points.particles.local(); ++i) {
        if (chosen[i] && numbers[i] >= 0) {
          throw Error(key + ": particle " + std::to_string(points.persistent_id[i]) + " is also held by pins." +
                      std::next(options.begin(), numbers[i])->first + ", expected each particle in one pin");
        }
        numbers[i] = chosen[i] ? pin : numbers[i];
      }
    });
    ++pin;
  }
  return numbers;
}

}  // namespace

void describe(OptionTable& table, SelectionOptions& options) {
  table.add("corners", options.corners,
            "geometric corners of the sheet (vertices of one cell only): all, or those at an end of an axis, such as "
            "max_y or min_x_max_y");
  table.add("box", options.box, Rules("m").length(6),
            "particles whose undeformed place is in the box between two points x,y,z,x,y,z");
  table.add("centre", options.centre, Rules("m").acts_with(is_given("radius", options.radius)),
            "centre of a ball, which selects as a box does");
  table.add("radius", options.radius, Rules("m").more_than(0), "radius of the ball");
  table.add(
      "layer", options.layer,
      Rules().acts_with({"box or radius", [&options] { return !options.box.empty() || options.radius.has_value(); }}),
      "which particles a box or a ball selects");
  table.add(
      "vertices", options.vertices, Rules().at_least(0),
      "persistent ids: vertex numbers of the mesh, or, for lattice points, its number of vertices plus a cell number");
  table.add("group", options.group, "named group of vertices in the mesh");
}

Eigen::AlignedBox3d bounding_box(const Surface& points, const std::vector<bool>& chosen) {
  Eigen::AlignedBox3d box;
  for (PetscInt i = 0; i < points.particles.owned; ++i) {
    if (chosen[i]) {
      box.extend(points.rest.col(i));
    }
  }
  min_over_ranks(points.comm(), box.min());
  max_over_ranks(points.comm(), box.max());
  return box;
}

std::vector<bool> select(const Surface& points, const std::string& key, const SelectionOptions& options) {
  if (!options.radius && !options.centre.isZero(0)) {
    throw Error(key + ".centre: given without a radius, expected both");
  }
  if (options.corners.empty() && options.box.empty() && !options.radius && options.vertices.empty() &&
      options.group.empty()) {
    throw Error(key + ": selects nothing, expected corners, box, centre and radius, vertices or group");
  }
  std::vector<bool> chosen(points.particles.local(), false);
  // Marks owned particles; each selector must select one on some rank. Collective.
  const auto add = [&](const std::string& selector, const auto& holds) {
    bool found = false;
    for (PetscInt i = 0; i < points.particles.owned; ++i) {
      if (holds(i)) {
        chosen[i] = found = true;
      }
    }
    if (!on_any_rank(points.comm(), found)) {
      throw Error(key + "." + selector + ": selects no particle, expected at least one");
    }
  };
  if (!options.corners.empty()) {
    std::vector<bool> corners(points.particles.owned);
    std::transform(points.cell_count.begin(), points.cell_count.end(), corners.begin(),
                   [](int cells) { return cells == 1; });
    const Eigen::AlignedBox3d box = bounding_box(points, corners);
    const double tolerance = 1e-6 * (box.isEmpty() ? 0 : box.diagonal().norm());
    for (const std::string& name : options.corners) {
      const std::array<int, 3> ends = parse_ends(name, key + ".corners");
      add("corners: " + name, [&](PetscInt i) {
        bool holds = corners[i];
        for (int axis = 0; holds && axis < 3; ++axis) {
          const double end = ends[axis] < 0 ? box.min()[axis] : box.max()[axis];
          holds = ends[axis] == 0 || std::abs(points.rest(axis, i) - end) <= tolerance;
        }
        return holds;
      });
    }
  }
  const auto in_layer = [&](PetscInt i) {
    return options.layer == Layer::both || points.is_lattice[i] == (options.layer == Layer::lattice);
  };
  if (!options.box.empty()) {
    const Eigen::Map<const Eigen::Vector3d> first(options.box.data());
    const Eigen::Map<const Eigen::Vector3d> second(options.box.data() + 3);
    const Eigen::AlignedBox3d box(first.cwiseMin(second), first.cwiseMax(second));
    add("box", [&](PetscInt i) { return in_layer(i) && box.contains(points.rest.col(i)); });
  }
  if (options.radius) {
    add("radius",
        [&](PetscInt i) { return in_layer(i) && (points.rest.col(i) - options.centre).norm() <= *options.radius; });
  }
  for (const int id : options.vertices) {
    add("vertices: " + std::to_string(id), [&](PetscInt i) { return points.persistent_id[i] == id; });
  }
  if (!options.group.empty()) {
    const std::vector<bool> members = members_of_group(points, key + ".group", options.group);
    add("group: " + options.group, [&](PetscInt i) { return members[i]; });
  }
  update_ghosts(points.particles, chosen);
  return chosen;
}

void describe(OptionTable& table, PinOptions& options) {
  describe(table, static_cast<SelectionOptions&>(options));
  table.add("velocity", options.velocity,
            Rules("m/s").acts_with({"no path", [&options] { return options.path.empty(); }}), "constant velocity");
  table.add("path", options.path, Rules("s,m,m,m"),
            "key points (time, x, y, z) of the displacement from the undeformed place; linear between key points, at "
            "rest before and after them");
  table.add("clamped", options.clamped,
            "holds the direction of an elastic sheet or of a balloon's wall, too, where these particles are at its "
            "edge; otherwise it turns there as on a hinge");
}

Pins::Pins(const Surface& points, const std::map<std::string, PinOptions>& options)
    : Pins(points, options, selected(points, options)) {}

Pins::Pins(const Surface& points, const std::map<std::string, PinOptions>& options,
           const std::vector<PetscInt>& numbers)
    : points_(&points), numbers_(numbers), pinned_(numbers.size(), false) {
  for (const auto& [name, given] : options) {
    refuse_fault("pins." + name, fault_of_motion(given.path, given.velocity));
    pins_.push_back({given, {}});
  }
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (numbers[i] >= 0) {
      pins_.at(numbers[i]).particles.push_back(static_cast<PetscInt>(i));
      pinned_[i] = true;
    }
  }
}

std::vector<bool> Pins::clamped() const {
  std::vector<bool> result(pinned_.size());
  std::transform(numbers_.begin(), numbers_.end(), result.begin(),
                 [this](PetscInt pin) { return pin >= 0 && pins_[pin].options.clamped; });
  return result;
}

void Pins::impose(Field& positions, double time) const {
  for (const auto& [pin, particles] : pins_) {
    const Eigen::Vector3d displacement = pin.motion ? pin.motion(time) : place_of_motion(pin.path, pin.velocity, time);
    for (const PetscInt i : particles) {
      positions.vector(i) = points_->rest.col(i) + displacement;
    }
  }
}

}  // namespace pellicle::constraints
