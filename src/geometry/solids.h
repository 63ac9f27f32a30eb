#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "geometry/closed_mesh.h"
#include "geometry/rigid_motion.h"

namespace pellicle::geometry {

/// Options of a shape in a deck: numbers of ShapeNumbers, the axis along which its z axis lies, or a plane's point
/// and normal.
enum class ShapeOption { radius, length, tube_radius, size, axis, plane };

/// The numbers that decks give shapes.
struct ShapeNumbers {
  double radius = 0;                               ///< [m]
  double length = 0;                               ///< [m]
  double tube_radius = 0;                          ///< [m]
  Eigen::Vector3d size = Eigen::Vector3d::Zero();  ///< [m]
};

// Solids in their own frames. is_convex says whether every straight line between two of its points is inside it;
// `distance` is the signed distance of a point, exact, also inside, where the normal is one of several ways out that
// are equally short; `box` is along the axes round all of it; `depth` is about the largest depth of a point on a way
// through its thinnest part [m]; `facets` are its surface, of a half space up to a distance.

/// Round the origin.
struct Sphere {
  static constexpr bool is_convex = true;
  SignedDistance distance(const Eigen::Vector3d& point) const;
  Eigen::AlignedBox3d box() const;
  double depth() const { return radius; }
  Facets facets(double half_plane) const;

  double radius = 0;  ///< [m]
};
/// Below the plane z = 0.
struct HalfSpace {
  static constexpr bool is_convex = true;
  SignedDistance distance(const Eigen::Vector3d& point) const;
  Eigen::AlignedBox3d box() const;
  double depth() const { return std::numeric_limits<double>::infinity(); }
  Facets facets(double half_plane) const;
};
/// Round the origin, its edges along the axes.
struct Box {
  static constexpr bool is_convex = true;
  SignedDistance distance(const Eigen::Vector3d& point) const;
  Eigen::AlignedBox3d box() const { return {-half, half}; }
  double depth() const { return half.minCoeff(); }
  Facets facets(double half_plane) const;

  Eigen::Vector3d half;  ///< half edges [m]
};
/// All points no further than the radius from the stretch of the z axis between -half and half.
struct Capsule {
  static constexpr bool is_convex = true;
  SignedDistance distance(const Eigen::Vector3d& point) const;
  Eigen::AlignedBox3d box() const;
  double depth() const { return radius; }
  Facets facets(double half_plane) const;

  double radius = 0;  ///< [m]
  double half = 0;    ///< [m]
};
/// Round the z axis, from -half to half.
struct Cylinder {
  static constexpr bool is_convex = true;
  SignedDistance distance(const Eigen::Vector3d& point) const;
  Eigen::AlignedBox3d box() const;
  double depth() const { return std::min(radius, half); }
  Facets facets(double half_plane) const;

  double radius = 0;  ///< [m]
  double half = 0;    ///< [m]
};
/// A torus: all points no further than the tube's radius from a circle round the z axis.
struct Ring {
  static constexpr bool is_convex = false;
  SignedDistance distance(const Eigen::Vector3d& point) const;
  Eigen::AlignedBox3d box() const;
  double depth() const { return tube; }
  Facets facets(double half_plane) const;

  double radius = 0;  ///< of the circle [m]
  double tube = 0;    ///< [m]
};

/// Shapes with a formula, and a mesh, whose sign comes from its pseudo-normals.
using Shape = std::variant<Sphere, HalfSpace, Box, Capsule, Cylinder, Ring, std::shared_ptr<const ClosedMesh>>;

/// A shape with a formula, as decks give it.
struct ShapeKind {
  std::string name;
  std::vector<ShapeOption> options;
  Shape (*of)(const ShapeNumbers& given);

  bool has(ShapeOption option) const { return std::find(options.begin(), options.end(), option) != options.end(); }
};
/// The kinds of all alternatives of Shape but the mesh, in the order in which messages name them.
const std::vector<ShapeKind>& shape_kinds();

/// A solid in its pose.
struct Solid {
  Shape shape;
  Pose pose;

  /// Whether every straight line between two of its points is inside it: all but rings and meshes.
  bool is_convex() const;
};

SignedDistance signed_distance(const Solid& solid, const Eigen::Vector3d& point);

/// A box along the axes of the shape's own frame round all of it; infinite sideways and below for a half space [m].
Eigen::AlignedBox3d box_round(const Shape& shape);
/// Depth of a shape; infinite for a half space, 0 of a mesh [m].
double depth_of(const Shape& shape);
/// The surface of a shape in its own frame. @param half_plane half side of the square that is drawn of a plane [m]
Facets facets_of(const Shape& shape, double half_plane);

}  // namespace pellicle::geometry
