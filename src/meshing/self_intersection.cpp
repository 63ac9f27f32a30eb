#include "meshing/self_intersection.h"

#include <algorithm>

#include "geometry/triangle_intersection.h"
#include "meshing/box_pairs.h"

namespace pellicle {
inline namespace meshing {

SelfIntersections count_self_intersections(const std::vector<Eigen::Vector3d>& points,
                                           const std::vector<std::array<int, 3>>& triangles) {
  Box whole;
  for (const Eigen::Vector3d& point : points) {
    whole.extend(point);
  }
  // Triangles that lie in one plane do not cut each other.
  if (triangles.empty() || whole.sizes().minCoeff() == 0) {
    return {};
  }
  const auto corners = [&](int triangle) -> Triangle {
    const std::array<int, 3>& t = triangles[triangle];
    return {points[t[0]], points[t[1]], points[t[2]]};
  };
  const auto have_common_point = [&triangles](int a, int b) {
    const std::array<int, 3>& points_of_a = triangles[a];
    const std::array<int, 3>& points_of_b = triangles[b];
    return std::find_first_of(points_of_b.begin(), points_of_b.end(), points_of_a.begin(), points_of_a.end()) !=
           points_of_b.end();
  };
  std::vector<Box> boxes;
  for (const std::array<int, 3>& triangle : triangles) {
    Box& box = boxes.emplace_back();
    for (const int point : triangle) {
      box.extend(points[point]);
    }
  }
  SelfIntersections found;
  found.all = visit_pairs(boxes, boxes, [&](int a, int b) {
    if (a >= b || have_common_point(a, b)) {
      return 0;
    }
    if (triangles_intersect(corners(a), corners(b))) {
      ++found.pairs;
      found.first = found.first[0] < 0 ? std::array{a, b} : std::min(found.first, std::array{a, b});
    }
    return 20;
  });
  return found;
}

}  // namespace meshing
}  // namespace pellicle
