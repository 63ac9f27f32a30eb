#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace pellicle {
inline namespace geometry {

using Triangles = std::vector<std::array<int, 3>>;

/// A triangulated surface, such as that of a solid in its own frame.
struct Facets {
  std::vector<Eigen::Vector3d> points;  ///< [m]
  Triangles triangles;                  ///< points of each, with normals outward
};

/// A line of places (distance from the z axis, height) turned round the axis, from below to above.
Facets revolved(const std::vector<Eigen::Vector2d>& line);

/// Adds an arc round a centre in the plane (x, z) to a line, from one angle to another, 0 along x [rad].
void add_arc(std::vector<Eigen::Vector2d>& line, const Eigen::Vector2d& centre, double radius, double from, double to);

}  // namespace geometry
}  // namespace pellicle
