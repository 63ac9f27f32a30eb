#include "constraints/constraints.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "base/error.h"
#include "base/units.h"
#include "parallel/collective.h"

namespace pellicle::constraints {

namespace {

/// Distance, as a fraction of the mesh's size, up to which a vertex is in a plane; normals that differ by less are
/// equal.
constexpr double nearness = 1e-6;

struct Plane {
  Eigen::Vector3d point;      ///< [m]
  Eigen::Vector3d normal;     ///< unit vector
  std::vector<bool> members;  ///< local vertices of the plane's group

  double distance(const Eigen::Vector3d& x) const { return std::abs(normal.dot(x - point)); }
};

/// Distance to the plane of its nearest member on any rank [m]; collective.
double nearest_distance(const Surface& points, const Plane& plane) {
  double nearest = std::numeric_limits<double>::infinity();
  for (PetscInt i = 0; i < points.particles.owned; ++i) {
    if (plane.members[i]) {
      nearest = std::min(nearest, plane.distance(points.rest.col(i)));
    }
  }
  return min_over_ranks(points.comm(), nearest);
}

/// The part of a unit vector normal to orthonormal axes, normalised; none if the vector lies in their span.
std::optional<Eigen::Vector3d> direction_beside(const std::vector<Eigen::Vector3d>& axes, Eigen::Vector3d normal) {
  for (const Eigen::Vector3d& axis : axes) {
    normal -= axis.dot(normal) * axis;
  }
  const double length = normal.norm();
  return length > nearness ? std::optional<Eigen::Vector3d>(normal / length) : std::nullopt;
}

/// The point nearest to `middle` that lies in all planes, if there is one [m].
Eigen::Vector3d common_point(const std::vector<Plane>& planes, const Eigen::Vector3d& middle) {
  Eigen::Vector3d point = middle;
  std::vector<Eigen::Vector3d> axes;
  for (const Plane& plane : planes) {
    if (const auto axis = direction_beside(axes, plane.normal)) {  // Along it the point stays in the planes before.
      point += plane.normal.dot(plane.point - point) / plane.normal.dot(*axis) * *axis;
      axes.push_back(*axis);
    }
  }
  return point;
}

}  // namespace

void describe(OptionTable& table, SymmetryOptions& options) {
  table.add("point", options.point, Rules("m"), "a point of the plane");
  table.add("normal", options.normal, "normal of the plane; any length");
  table.add("group", options.group,
            "named group of vertices in the mesh: only those that lie in the plane and are in it stay; empty: all");
}

Constraints::Constraints(const Surface& points, const std::map<std::string, SymmetryOptions>& symmetry,
                         const Pins& pins)
    : projectors(points.particles.local()) {
  const Eigen::AlignedBox3d box = bounding_box(points, std::vector<bool>(projectors.size(), true));
  const double tolerance = nearness * box.diagonal().norm();
  origin = box.center();
  std::vector<Plane> known;
  for (const auto& [name, given] : symmetry) {
    const std::string key = "symmetry." + name;
    if (given.normal.isZero(0)) {
      throw Error(key + ".normal: 0, 0, 0 given, expected a vector that is not zero");
    }
    std::vector<bool> members(projectors.size(), true);
    if (!given.group.empty()) {
      SelectionOptions selection;
      selection.group = given.group;
      members = select(points, key, selection);
    }
    known.push_back({given.point, given.normal.stableNormalized(), std::move(members)});
    planes.normals.push_back(known.back().normal);
    const double nearest = nearest_distance(points, known.back());
    if (nearest > tolerance) {
      throw Error(key + ": the nearest vertex is " + number_text(nearest) + " m away, expected vertices in the plane");
    }
    origin = common_point(known, box.center());
    for (const Plane& plane : known) {
      if (plane.distance(origin) > tolerance) {
        throw Error(key + ": shares no point with the planes named before it, expected planes that all meet in one");
      }
    }
  }
  constexpr std::size_t most_planes = 32;
  if (known.size() > most_planes) {
    throw Error("symmetry: " + std::to_string(known.size()) + " planes, expected at most 32");
  }
  planes.of_particle.assign(known.empty() ? 0 : projectors.size(), 0);
  for (PetscInt i = 0; i < points.particles.local(); ++i) {
    Eigen::Matrix3d projector = Eigen::Matrix3d::Identity();
    std::vector<Eigen::Vector3d> barred;
    for (std::size_t k = 0; k < known.size(); ++k) {
      if (known[k].members[i] && known[k].distance(points.rest.col(i)) <= tolerance) {
        planes.of_particle[i] |= 1U << k;
        if (const auto axis = direction_beside(barred, known[k].normal)) {
          projector -= *axis * axis->transpose();
          barred.push_back(*axis);
        }
      }
    }
    if (pins.pinned()[i] || barred.size() == 3) {
      projector.setZero();
    }
    projectors.bind(i, projector);
  }
}

}  // namespace pellicle::constraints
