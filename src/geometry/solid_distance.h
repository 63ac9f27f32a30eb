#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "base/namespaces.h"

namespace pellicle::geometry {

// Distances of a point from the surface of a solid that lies in its own frame, negative inside [m]. Formulas of I.
// Quilez, "Distance functions" (iquilezles.org). Exact, except for the ellipsoid.

/// A ball round the origin.
inline double distance_from_sphere(const Eigen::Vector3d& point, double radius) { return point.norm() - radius; }

/// An ellipsoid round the origin with half axes `half`. A first-order estimate, right in sign and near the surface.
inline double distance_from_ellipsoid(const Eigen::Vector3d& point, const Eigen::Vector3d& half) {
  const double k0 = point.cwiseQuotient(half).norm();
  const double k1 = point.cwiseQuotient(half.cwiseProduct(half)).norm();
  return k1 > 0 ? k0 * (k0 - 1) / k1 : -half.minCoeff();
}

/// A box round the origin with half edges `half`, its edges and corners rounded by the radius `round`.
inline double distance_from_box(const Eigen::Vector3d& point, const Eigen::Vector3d& half, double round) {
  const Eigen::Vector3d q = point.cwiseAbs() - half + Eigen::Vector3d::Constant(round);
  return q.cwiseMax(0).norm() + std::min(q.maxCoeff(), 0.0) - round;
}

/// A cylinder from the origin up the z axis, its rims rounded by the radius `round`.
inline double distance_from_cylinder(const Eigen::Vector3d& point, double radius, double length, double round) {
  const Eigen::Vector2d q(point.head<2>().norm() - radius + round,
                          std::abs(point.z() - 0.5 * length) - 0.5 * length + round);
  return q.cwiseMax(0).norm() + std::min(q.maxCoeff(), 0.0) - round;
}

/// The convex hull of a ball of radius `r` round the origin and one of radius `s` round (0, 0, length), where
/// |r - s| < length: a capsule if both are the same, a round cone otherwise.
inline double distance_from_round_cone(const Eigen::Vector3d& point, double r, double s, double length) {
  const Eigen::Vector2d q(point.head<2>().norm(), point.z());
  const double slope = (r - s) / length;
  const double cosine = std::sqrt(1 - slope * slope);
  const double along = cosine * q.y() - slope * q.x();
  if (along < 0) {
    return q.norm() - r;
  }
  return along > cosine * length ? std::hypot(q.x(), q.y() - length) - s : cosine * q.x() + slope * q.y() - r;
}

/// A torus round the z axis.
inline double distance_from_torus(const Eigen::Vector3d& point, double major_radius, double tube_radius) {
  return std::hypot(point.head<2>().norm() - major_radius, point.z()) - tube_radius;
}

}  // namespace pellicle::geometry
