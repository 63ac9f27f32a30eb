#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "geometry/solids.h"
#include "geometry/triangle_intersection.h"

namespace pellicle {
inline namespace geometry {

/// The point of a triangle that is deepest in a solid, or nearest to it.
struct DeepestPoint {
  Eigen::Vector3d weights;  ///< of the corners, sum 1
  SignedDistance gap;       ///< there
};

/// Found by halving the triangle where the distance may be least, by least_distance. Then by bracketing. Exact for
/// spheres and half spaces. For rings and meshes what is found is the least distance to within `tolerance` unless the
/// solid has features much smaller than a sixteenth of the triangle.
/// @param corners [m], which may coincide or be in a line
/// @param reach points further away than this do not count [m]
/// @param tolerance of the distance [m]
/// @returns nothing if every point of the triangle is further away than `reach`
std::optional<DeepestPoint> deepest_point(const Solid& solid, const Triangle& corners, double reach, double tolerance);

/// The four parts into which the lines between the middles of its sides divide a triangle, which is given by places or
/// by the weights of other corners.
std::array<Triangle, 4> quarters(const Triangle& triangle);

/// A distance from a solid that no point of a triangle falls below: that from a convex solid lies above its tangent
/// plane at the middle of the triangle, and that from any other solid falls by no more than the way from there.
/// @param middle of the three corners [m] @param gap there
double least_distance(const Solid& solid, const Triangle& corners, const Eigen::Vector3d& middle,
                      const SignedDistance& gap);

}  // namespace geometry
}  // namespace pellicle
