#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "geometry/solids.h"
#include "geometry/triangle_intersection.h"

namespace pellicle::geometry {

/// The point of a triangle that is deepest in a solid, or nearest to it.
struct DeepestPoint {
  Eigen::Vector3d weights;  ///< of the corners, sum 1
  SignedDistance gap;       ///< of the point
};

/// Finds the deepest point by halving the triangle where the distance may be least (least_distance), then by
/// bracketing. Exact for spheres and half spaces. For rings and meshes the least distance is found to within
/// `tolerance` unless the solid has features much smaller than a sixteenth of the triangle.
/// @param corners [m], which may coincide or be in a line
/// @param reach points further away than this are left out [m]
/// @param tolerance of the distance [m]
/// @returns none if every point of the triangle is further away than `reach`
std::optional<DeepestPoint> deepest_point(const Solid& solid, const Triangle& corners, double reach, double tolerance);

/// The four parts into which the lines between the middles of its sides divide a triangle, which is given by places or
/// by the weights of other corners.
std::array<Triangle, 4> quarters(const Triangle& triangle);

/// Lower bound of the distances of a triangle's points from a solid: the distance from a convex solid is at least that
/// from its tangent plane at the middle of the triangle; from any other solid it falls by at most the way from there.
/// @param middle of the three corners [m] @param gap there
double least_distance(const Solid& solid, const Triangle& corners, const Eigen::Vector3d& middle,
                      const SignedDistance& gap);

}  // namespace pellicle::geometry
