#include "meshing/self_intersection.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstdint>
#include <unsupported/Eigen/BVH>

#include "geometry/triangle_intersection.h"

namespace pellicle {
inline namespace meshing {

namespace {

using Box = Eigen::AlignedBox3d;

/// What Eigen's traversal of two trees of boxes calls; the names are Eigen's.
struct PairCounter {
  const std::vector<std::array<int, 3>>& triangles;
  const std::vector<Eigen::Vector3d>& points;
  const std::vector<Box>& boxes;
  std::int64_t pairs_left;  ///< of boxes that may still be compared
  int count = 0;
  std::array<int, 2> first{-1, -1};

  // NOLINTBEGIN(readability-identifier-naming)
  /// Every descent asks this of its pair: when no pairs are left, the traversal soon ends.
  bool intersectVolumeVolume(const Box& a, const Box& b) { return pairs_left-- > 0 && a.intersects(b); }
  bool intersectVolumeObject(const Box& a, int b) {
    return intersectVolumeVolume(a, boxes[static_cast<std::size_t>(b)]);
  }
  bool intersectObjectVolume(int a, const Box& b) { return intersectVolumeObject(b, a); }
  /// Counts the pair; stops the traversal when no pairs are left.
  bool intersectObjectObject(int a, int b) {
    if (pairs_left-- <= 0) {
      return true;
    }
    if (a < b && boxes[static_cast<std::size_t>(a)].intersects(boxes[static_cast<std::size_t>(b)]) &&
        !have_common_point(a, b)) {
      constexpr int cost = 20;  // in comparisons of boxes
      pairs_left -= cost;
      if (triangles_intersect(corners(a), corners(b))) {
        ++count;
        first = first[0] < 0 ? std::array{a, b} : std::min(first, std::array{a, b});
      }
    }
    return false;
  }
  // NOLINTEND(readability-identifier-naming)

  bool have_common_point(int a, int b) const {
    const std::array<int, 3>& points_of_b = triangles[static_cast<std::size_t>(b)];
    return std::find_first_of(points_of_b.begin(), points_of_b.end(), triangles[static_cast<std::size_t>(a)].begin(),
                              triangles[static_cast<std::size_t>(a)].end()) != points_of_b.end();
  }
  Triangle corners(int triangle) const {
    const std::array<int, 3>& t = triangles[static_cast<std::size_t>(triangle)];
    return {points[static_cast<std::size_t>(t[0])], points[static_cast<std::size_t>(t[1])],
            points[static_cast<std::size_t>(t[2])]};
  }
};

}  // namespace

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
  std::vector<Box> boxes;
  std::vector<int> numbers;
  for (const std::array<int, 3>& triangle : triangles) {
    Box& box = boxes.emplace_back();
    numbers.push_back(static_cast<int>(numbers.size()));
    for (const int point : triangle) {
      box.extend(points[static_cast<std::size_t>(point)]);
    }
  }
  const Eigen::KdBVH<double, 3, int> tree(numbers.begin(), numbers.end(), boxes.begin(), boxes.end());
  constexpr std::int64_t least = 100000000;
  constexpr std::int64_t of_a_triangle = 300;
  PairCounter counter{triangles, points, boxes,
                      std::max(least, of_a_triangle * static_cast<std::int64_t>(triangles.size()))};
  Eigen::BVIntersect(tree, tree, counter);
  return {counter.count, counter.first, counter.pairs_left > 0};
}

}  // namespace meshing
}  // namespace pellicle
