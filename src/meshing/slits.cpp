#include "meshing/slits.h"

#include <algorithm>
#include <limits>

#include "meshing/box_pairs.h"

namespace pellicle {
inline namespace meshing {

Slits find_slits(const SurfaceMesh& mesh, const std::vector<std::array<int, 2>>& boundary) {
  const auto at = [&mesh](int point) -> const Eigen::Vector3d& { return mesh.points[point]; };
  double farthest = 0;
  for (const Eigen::Vector3d& point : mesh.points) {
    farthest = std::max(farthest, point.lpNorm<Eigen::Infinity>());
  }
  constexpr double fraction = 1e-6;
  constexpr double most = 1e-3;
  // The longer side of the boundary at each of its points, 0 elsewhere; then how near to it is near.
  std::vector<double> reach(mesh.points.size(), 0);
  for (const auto& [a, b] : boundary) {
    for (const int end : {a, b}) {
      double& longest = reach[end];
      longest = std::max(longest, (at(b) - at(a)).norm());
    }
  }
  std::vector<int> points;
  std::vector<Box> round_points;
  for (std::size_t i = 0; i < reach.size(); ++i) {
    if (reach[i] > 0) {
      reach[i] = std::min(std::max(fraction * reach[i], fraction * farthest), most * reach[i]);
      points.push_back(static_cast<int>(i));
      const Eigen::Vector3d half = Eigen::Vector3d::Constant(reach[i] / 2);
      round_points.emplace_back(mesh.points[i] - half, mesh.points[i] + half);
    }
  }
  const auto reach_of = [&reach](int point) { return reach[point]; };

  Slits slits;
  std::vector<bool> is_near(mesh.points.size(), false);
  visit_pairs(round_points, round_points, [&](int first, int second) {
    const int a = points[first];
    const int b = points[second];
    const double gap = (at(a) - at(b)).norm();
    if (a != b && gap > 0 && gap <= std::min(reach_of(a), reach_of(b))) {
      is_near[a] = is_near[b] = true;
      slits.largest_gap = std::max(slits.largest_gap, gap);
    }
    return 1;
  });
  slits.near_points = static_cast<int>(std::count(is_near.begin(), is_near.end(), true));

  std::vector<Box> round_sides;
  for (const auto& [a, b] : boundary) {
    Box box(at(a));
    box.extend(at(b));
    const Eigen::Vector3d margin = Eigen::Vector3d::Constant(std::max(reach_of(a), reach_of(b)));
    round_sides.emplace_back(box.min() - margin, box.max() + margin);
  }
  visit_pairs(round_points, round_sides, [&](int number, int side) {
    const int point = points[number];
    const auto& [a, b] = boundary[side];
    const Eigen::Vector3d along = at(b) - at(a);
    const double length = along.norm();
    const double place = (at(point) - at(a)).dot(along) / length;  // [m] from a
    const double near = std::min(reach_of(point), std::min(reach_of(a), reach_of(b)));
    if (place > near && place < length - near && (at(point) - at(a) - place / length * along).norm() <= near) {
      slits.on_sides.push_back(point);
    }
    return 1;
  });
  std::sort(slits.on_sides.begin(), slits.on_sides.end());
  slits.on_sides.erase(std::unique(slits.on_sides.begin(), slits.on_sides.end()), slits.on_sides.end());
  return slits;
}

}  // namespace meshing
}  // namespace pellicle
