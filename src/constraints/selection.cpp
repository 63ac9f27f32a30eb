#include "constraints/selection.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include "base/error.h"
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

}  // namespace

void describe(OptionTable& table, SelectionOptions& options) {
  table.add("corners", options.corners,
            "geometric corners of the sheet (vertices of one cell only): all, or those at an end of an axis, such as "
            "max_y or min_x_max_y");
  table.add("box", options.box, Rules("m").length(6),
            "particles whose undeformed place is in the box between two points x,y,z,x,y,z");
  table.add("centre", options.centre,
            Rules("m").acts_with({"radius", [&options] { return options.radius.has_value(); }}),
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

}  // namespace pellicle::constraints
