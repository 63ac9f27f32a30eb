#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "geometry/rigid_motion.h"

namespace pellicle::geometry {

using Triangles = std::vector<std::array<int, 3>>;

/// A triangulated surface, such as that of a solid in its own frame.
struct Facets {
  std::vector<Eigen::Vector3d> points;  ///< [m]
  Triangles triangles;                  ///< points of each, with normals outward
};

/// Signed distance of a point from a solid, negative inside, with the outward direction.
struct SignedDistance {
  double distance = 0;     ///< [m]
  Eigen::Vector3d normal;  ///< unit vector, gradient of the distance
};

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

/// Message if triangles are not a closed surface with normals outward; otherwise empty.
std::string fault_of_closed_mesh(const std::vector<Eigen::Vector3d>& points, const Triangles& triangles);

/// A solid given by triangles round it, in a tree of boxes.
class ClosedMesh {
 public:
  static constexpr bool is_convex = false;

  /// @param points [m] @param triangles a closed surface with normals outward (fault_of_closed_mesh); those without
  /// area are left out
  ClosedMesh(std::vector<Eigen::Vector3d> points, Triangles triangles);

  /// Distance with the sign by the angle-weighted normal at the nearest point (Baerentzen and Aanaes 2005).
  SignedDistance distance(const Eigen::Vector3d& point) const;

  const Eigen::AlignedBox3d& box() const { return nodes_.front().box; }  ///< box round the mesh [m]
  double depth() const { return 0; }
  Facets facets(double /*half_plane*/) const { return {points_, triangles_}; }

 private:
  struct Node {
    Eigen::AlignedBox3d box;
    int begin = 0;  ///< first triangle in `order_`
    int end = 0;
    int second = 0;  ///< second child, while the first follows the node; 0: a leaf
  };
  void build(int begin, int end);
  const Eigen::Vector3d& normal_at(std::size_t triangle, const std::array<double, 4>& weights) const;

  std::vector<Eigen::Vector3d> points_;
  Triangles triangles_;
  std::vector<Eigen::Vector3d> face_normals_;
  std::vector<Eigen::Vector3d> vertex_normals_;               ///< angle-weighted, not of unit length
  std::vector<std::array<Eigen::Vector3d, 3>> edge_normals_;  ///< of the sides from corner k, not of unit length
  std::vector<int> order_;
  std::vector<Node> nodes_;
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
