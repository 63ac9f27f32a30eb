#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "geometry/solids.h"

namespace pellicle {
inline namespace geometry {

/// The point of a triangle that is deepest in a solid, or nearest to it.
struct DeepestPoint {
  Eigen::Vector3d weights;  ///< of the corners, sum 1
  SignedDistance gap;       ///< there
};

/// Found by halving the triangle where the distance may be least. Lower bounds of the distance: for a convex solid,
/// whose distance is a convex function, its tangent plane; for other solids the distance at the middle of a part, less
/// the part's radius. Then by bracketing. Exact for spheres and half spaces. For rings and meshes what is found is the
/// least distance to within `tolerance` unless the solid has features much smaller than a sixteenth of the triangle.
/// @param corners [m], which may coincide or be in a line
/// @param reach points further away than this do not count [m]
/// @param tolerance of the distance [m]
/// @returns nothing if every point of the triangle is further away than `reach`
std::optional<DeepestPoint> deepest_point(const Solid& solid, const std::array<Eigen::Vector3d, 3>& corners,
                                          double reach, double tolerance);

}  // namespace geometry
}  // namespace pellicle
