#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace pellicle {
inline namespace meshing {

/// Pairs of triangles that cut through each other.
struct SelfIntersections {
  int pairs = 0;
  std::array<int, 2> first{-1, -1};  ///< pair with the lowest numbers
  bool all = true;                   ///< false if the count was ended because too many boxes of triangles overlap
};

/// Counts the pairs of triangles that cut through each other (triangles_intersect); triangles with a common point are
/// left out. By a tree of bounding boxes, whose cost is n log n for surfaces; where nearly all of them overlap, as of a
/// heap of long needles, the count ends after the work of some hundred pairs of boxes a triangle, and at least 10^8.
SelfIntersections count_self_intersections(const std::vector<Eigen::Vector3d>& points,
                                           const std::vector<std::array<int, 3>>& triangles);

}  // namespace meshing
}  // namespace pellicle
