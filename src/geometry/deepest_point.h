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

/// By halving the triangle where the distance may be least: below the tangent plane of a convex solid's distance, which
/// is a convex function, or no less than the distance to the middle of a part of other solids', less the part's radius;
/// then by bracketing. Exact for spheres and half spaces. For rings and meshes what is found is the least distance to
/// within `tolerance` unless the solid has features much smaller than a sixteenth of the triangle.
/// @param corners [m], which may coincide or be in a line
/// @param reach what is further than this away does not count [m]
/// @param tolerance of the distance [m]
/// @returns nothing if every point of the triangle is further away than `reach`
std::optional<DeepestPoint> deepest_point(const Solid& solid, const std::array<Eigen::Vector3d, 3>& corners,
                                          double reach, double tolerance);

}  // namespace geometry
}  // namespace pellicle
