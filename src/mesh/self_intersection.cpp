#include "mesh/self_intersection.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <unsupported/Eigen/BVH>

#include "geometry/triangle_intersection.h"

namespace pellicle {
namespace {

using Box = Eigen::AlignedBox3d;

/// What Eigen's traversal of two box trees asks, by its names.
struct PairCounter {
  const std::vector<std::array<int, 3>>& triangles;
  const std::vector<Eigen::Vector3d>& points;
  const std::vector<Box>& boxes;
  int count = 0;

  // NOLINTBEGIN(readability-identifier-naming)
  static bool intersectVolumeVolume(const Box& a, const Box& b) { return a.intersects(b); }
  bool intersectVolumeObject(const Box& a, int b) const { return a.intersects(boxes[static_cast<std::size_t>(b)]); }
  bool intersectObjectVolume(int a, const Box& b) const { return intersectVolumeObject(b, a); }
  /// Counts the pair; never stops the traversal.
  bool intersectObjectObject(int a, int b) {
    if (a < b && boxes[static_cast<std::size_t>(a)].intersects(boxes[static_cast<std::size_t>(b)]) &&
        !have_common_point(a, b) && triangles_intersect(corners(a), corners(b))) {
      ++count;
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

int count_self_intersections(const SurfaceMesh& mesh) {
  std::vector<std::array<int, 3>> triangles;
  std::vector<Box> boxes;
  std::vector<int> numbers;
  for (const std::vector<int>& face : mesh.faces) {
    for (std::size_t k = 2; k < face.size(); ++k) {
      Box& box = boxes.emplace_back();
      numbers.push_back(static_cast<int>(numbers.size()));
      for (const int point : triangles.emplace_back(std::array<int, 3>{face[0], face[k - 1], face[k]})) {
        box.extend(mesh.points[static_cast<std::size_t>(point)]);
      }
    }
  }
  const Eigen::KdBVH<double, 3, int> tree(numbers.begin(), numbers.end(), boxes.begin(), boxes.end());
  PairCounter counter{triangles, mesh.points, boxes};
  Eigen::BVIntersect(tree, tree, counter);
  return counter.count;
}

}  // namespace pellicle
