#pragma once

#include <Eigen/Core>
#include <array>

namespace pellicle {
inline namespace geometry {

using Triangle = std::array<Eigen::Vector3d, 3>;

/// Whether the segment from p to q passes through the inside of a triangle. In plain double precision.
bool segment_cuts_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& q, const Triangle& t);

/// Whether two triangles cut through each other: an edge of one passes through the inside of the other. Triangles that
/// lie in one plane, or only touch, do not. In plain double precision.
bool triangles_intersect(const Triangle& first, const Triangle& second);

}  // namespace geometry
}  // namespace pellicle
