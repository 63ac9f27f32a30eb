#pragma once

#include <Eigen/Core>
#include <variant>

namespace pellicle {
inline namespace geometry {

/// How far a point is outside a solid (negative: inside) and which way is out.
struct SignedDistance {
  double distance = 0;     ///< [m]
  Eigen::Vector3d normal;  ///< unit vector, gradient of the distance
};

struct Sphere {
  Eigen::Vector3d centre;  ///< [m]
  double radius = 0;       ///< [m]
};

/// The side of a plane that the normal points away from.
struct HalfSpace {
  Eigen::Vector3d point;   ///< of the plane [m]
  Eigen::Vector3d normal;  ///< unit vector, points out of the solid
};

using Solid = std::variant<Sphere, HalfSpace>;

/// At the very centre of a sphere, where no direction is nearest, the normal is the z axis.
inline SignedDistance signed_distance(const Sphere& sphere, const Eigen::Vector3d& point) {
  const Eigen::Vector3d arm = point - sphere.centre;
  const double length = arm.norm();
  const Eigen::Vector3d normal = length > 0 ? Eigen::Vector3d(arm / length) : Eigen::Vector3d(Eigen::Vector3d::UnitZ());
  return {length - sphere.radius, normal};
}

inline SignedDistance signed_distance(const HalfSpace& half_space, const Eigen::Vector3d& point) {
  return {half_space.normal.dot(point - half_space.point), half_space.normal};
}

inline SignedDistance signed_distance(const Solid& solid, const Eigen::Vector3d& point) {
  return std::visit([&point](const auto& shape) { return signed_distance(shape, point); }, solid);
}

inline Solid moved_by(const Eigen::Vector3d& displacement, Solid solid) {
  if (auto* sphere = std::get_if<Sphere>(&solid)) {
    sphere->centre += displacement;
  } else {
    std::get<HalfSpace>(solid).point += displacement;
  }
  return solid;
}

}  // namespace geometry
}  // namespace pellicle
