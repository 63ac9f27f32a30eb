#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <string>
#include <vector>

#include "base/namespaces.h"

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

/// Message if triangles are not a closed surface with normals outward; otherwise empty.
std::string fault_of_closed_mesh(const std::vector<Eigen::Vector3d>& points, const Triangles& triangles);

/// A solid given by triangles round it, in a tree of boxes. What decks know of it is as for shapes with a formula
/// (geometry/solids.h).
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

}  // namespace pellicle::geometry
