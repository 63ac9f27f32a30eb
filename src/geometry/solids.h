#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <variant>

#include "geometry/closed_mesh.h"
#include "geometry/rigid_motion.h"
#include "geometry/signed_distance.h"

namespace pellicle {
inline namespace geometry {

// Solids in their own frames.

/// Round the origin.
struct Sphere {
  double radius = 0;  ///< [m]
};
/// Below the plane z = 0.
struct HalfSpace {};
/// Round the origin, its edges along the axes.
struct Box {
  Eigen::Vector3d half;  ///< half edges [m]
};
/// All points no further than the radius from the stretch of the z axis between -half and half.
struct Capsule {
  double radius = 0;  ///< [m]
  double half = 0;    ///< [m]
};
/// Round the z axis, from -half to half.
struct Cylinder {
  double radius = 0;  ///< [m]
  double half = 0;    ///< [m]
};
/// A torus: all points no further than the tube's radius from a circle round the z axis.
struct Ring {
  double radius = 0;  ///< of the circle [m]
  double tube = 0;    ///< [m]
};

using Shape = std::variant<Sphere, HalfSpace, Box, Capsule, Cylinder, Ring, std::shared_ptr<const ClosedMesh>>;

// Exact, also inside, except that a mesh's sign comes from its pseudo-normals; where several ways out are equally short
// the normal is one of them.
SignedDistance signed_distance(const Sphere& sphere, const Eigen::Vector3d& point);
SignedDistance signed_distance(const HalfSpace& half_space, const Eigen::Vector3d& point);
SignedDistance signed_distance(const Box& box, const Eigen::Vector3d& point);
SignedDistance signed_distance(const Capsule& capsule, const Eigen::Vector3d& point);
SignedDistance signed_distance(const Cylinder& cylinder, const Eigen::Vector3d& point);
SignedDistance signed_distance(const Ring& ring, const Eigen::Vector3d& point);
SignedDistance signed_distance(const std::shared_ptr<const ClosedMesh>& mesh, const Eigen::Vector3d& point);

/// A solid in its pose.
struct Solid {
  Shape shape;
  Pose pose;

  /// Whether every straight line between two of its points is inside it: all but rings and meshes.
  bool is_convex() const {
    return !std::holds_alternative<Ring>(shape) && !std::holds_alternative<std::shared_ptr<const ClosedMesh>>(shape);
  }
};

SignedDistance signed_distance(const Solid& solid, const Eigen::Vector3d& point);

/// A box along the axes of the shape's own frame round all of it; infinite sideways and below for a half space [m].
Eigen::AlignedBox3d box_round(const Shape& shape);

/// Depth of a shape, about the largest depth of a point on a way through its thinnest part; infinite for a half space
/// [m].
double depth_of(const Shape& shape);

}  // namespace geometry
}  // namespace pellicle
