#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>

#include "base/namespaces.h"

namespace pellicle::geometry {

using Triangle = std::array<Eigen::Vector3d, 3>;

/// Whether two triangles on numbered points have a point in common.
inline bool have_common_point(const std::array<int, 3>& a, const std::array<int, 3>& b) {
  return std::find_first_of(a.begin(), a.end(), b.begin(), b.end()) != a.end();
}

/// Length of the longest side.
inline double longest_side(const Triangle& t) {
  return std::max({(t[1] - t[0]).norm(), (t[2] - t[1]).norm(), (t[0] - t[2]).norm()});
}

/// Whether the segment from p to q passes through the inside of a triangle. In plain double precision.
bool segment_cuts_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& q, const Triangle& t);

/// Whether two triangles cut through each other: an edge of one passes through the inside of the other. Triangles that
/// lie in one plane, or only touch, do not. In plain double precision.
bool triangles_intersect(const Triangle& first, const Triangle& second);

}  // namespace pellicle::geometry
