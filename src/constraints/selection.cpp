#include "constraints/selection.h"

#include <array>
#include <cmath>
#include <sstream>
#include <utility>

#include "base/error.h"
#include "parallel/collective.h"
#include "parallel/exchange.h"
#include "surface/groups.h"

namespace pellicle {
inline namespace constraints {

namespace {

/// The condition of a name such as "min_x_max_y": for each axis the lowest end, the highest, or neither.
struct Ends {
  std::array<int, 3> wanted{0, 0, 0};  ///< -1 lowest, 1 highest, 0 any
};

[[noreturn]] void refuse_corner(const std::string& key, const std::string& name) {
  throw Error(key + ": '" + name + "' names no corner, expected all, or ends such as max_y or min_x_max_y");
}

Ends parse_ends(const std::string& name, const std::string& key) {
  Ends ends;
  if (name == "all") {
    return ends;
  }
  std::istringstream words(name);
  std::string end;
  std::string axis;
  while (std::getline(words, end, '_')) {
    if (!std::getline(words, axis, '_') || (end != "min" && end != "max") || axis.size() != 1 || axis[0] < 'x' ||
        axis[0] > 'z') {
      refuse_corner(key, name);
    }
    ends.wanted[axis[0] - 'x'] = end == "min" ? -1 : 1;
  }
  return ends;
}

/// Marks owned particles for one object of a deck; each selector must select a particle on some rank.
class Selection {
 public:
  Selection(const Surface& points, std::string key)
      : points_(points), key_(std::move(key)), chosen_(points.particles.owned, false) {}

  /// The marks of all local particles; ghosts have those of their owners. Collective.
  std::vector<bool> chosen() const {
    std::vector<bool> all = chosen_;
    all.resize(points_.particles.local());
    update_ghosts(points_.particles, all);
    return all;
  }

  template <class Condition>
  void add(const std::string& selector, const Condition& holds) {
    PetscInt found = 0;
    for (PetscInt i = 0; i < points_.particles.owned; ++i) {
      if (holds(i)) {
        chosen_[i] = true;
        ++found;
      }
    }
    if (sum_over_ranks(points_.comm(), found) == 0) {
      throw Error(key_ + "." + selector + ": selects no particle, expected at least one");
    }
  }

 private:
  const Surface& points_;
  std::string key_;
  std::vector<bool> chosen_;  ///< of each owned particle
};

/// The owned corners with one cell only.
std::vector<bool> geometric_corners(const Surface& points) {
  std::vector<bool> corners(points.particles.owned);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    corners[i] = points.cell_count[i] == 1;
  }
  return corners;
}

}  // namespace

void describe(OptionTable& table, SelectionOptions& options) {
  table.add("corners", options.corners)
      .help(
          "geometric corners of the sheet (vertices of one cell only): all, or those at an end of an axis, such as "
          "max_y or min_x_max_y");
  table.add("box", options.box)
      .unit("m")
      .length(6)
      .help("particles whose undeformed place is in the box between two points x,y,z,x,y,z");
  table.add("centre", options.centre)
      .unit("m")
      .acts_with({"radius", [&options] { return options.radius.has_value(); }})
      .help("centre of a ball, which selects as a box does");
  table.add("radius", options.radius).unit("m").more_than(0).help("radius of the ball");
  table.add("layer", options.layer)
      .acts_with({"box or radius", [&options] { return !options.box.empty() || options.radius.has_value(); }})
      .help("which particles a box or a ball selects");
  table.add("vertices", options.vertices)
      .at_least(0)
      .help(
          "persistent ids: vertex numbers of the mesh, or, for lattice points, its number of vertices plus a cell "
          "number");
  table.add("group", options.group).help("named group of vertices in the mesh");
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
  Selection selection(points, key);
  if (!options.radius && !options.centre.isZero(0)) {
    throw Error(key + ".centre: given without a radius, expected both");
  }
  if (options.corners.empty() && options.box.empty() && !options.radius && options.vertices.empty() &&
      options.group.empty()) {
    throw Error(key + ": selects nothing, expected corners, box, centre and radius, vertices or group");
  }
  if (!options.corners.empty()) {
    const std::vector<bool> corners = geometric_corners(points);
    const Eigen::AlignedBox3d box = bounding_box(points, corners);
    const double tolerance = 1e-6 * (box.isEmpty() ? 0 : box.diagonal().norm());
    for (const std::string& name : options.corners) {
      const Ends ends = parse_ends(name, key + ".corners");
      selection.add("corners: " + name, [&](PetscInt i) {
        bool holds = corners[i];
        for (int axis = 0; holds && axis < 3; ++axis) {
          const int wanted = ends.wanted[axis];
          const double end = wanted < 0 ? box.min()[axis] : box.max()[axis];
          holds = wanted == 0 || std::abs(points.rest(axis, i) - end) <= tolerance;
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
    selection.add("box", [&](PetscInt i) { return in_layer(i) && box.contains(points.rest.col(i)); });
  }
  if (options.radius) {
    selection.add("radius", [&](PetscInt i) {
      return in_layer(i) && (points.rest.col(i) - options.centre).norm() <= *options.radius;
    });
  }
  for (const int id : options.vertices) {
    selection.add("vertices: " + std::to_string(id), [&](PetscInt i) { return points.persistent_id[i] == id; });
  }
  if (!options.group.empty()) {
    const std::vector<bool> members = members_of_group(points, key + ".group", options.group);
    selection.add("group: " + options.group, [&](PetscInt i) { return members[i]; });
  }
  return selection.chosen();
}

}  // namespace constraints
}  // namespace pellicle
