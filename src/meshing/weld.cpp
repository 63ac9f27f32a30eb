#include "meshing/weld.h"

#include <algorithm>
#include <numeric>
#include <tuple>

#include "base/disjoint_sets.h"
#include "base/error.h"
#include "base/units.h"
#include "meshing/box_pairs.h"

namespace pellicle {
inline namespace meshing {

namespace {

/// The points at the same place, exactly.
DisjointSets equal_points(const std::vector<Eigen::Vector3d>& points) {
  std::vector<int> order(points.size());
  std::iota(order.begin(), order.end(), 0);
  const auto at = [&points](int i) -> const Eigen::Vector3d& { return points[i]; };
  std::sort(order.begin(), order.end(), [&at](int a, int b) {
    return std::tie(at(a).x(), at(a).y(), at(a).z(), a) < std::tie(at(b).x(), at(b).y(), at(b).z(), b);
  });
  DisjointSets sets(points.size());
  for (std::size_t k = 1; k < order.size(); ++k) {
    if (at(order[k]) == at(order[k - 1])) {
      sets.unite(order[k], order[k - 1]);
    }
  }
  return sets;
}

/// Unites the points of different sets that are near each other. @returns whether all of these were found
bool unite_near_points(DisjointSets& sets, const std::vector<Eigen::Vector3d>& points, double distance) {
  std::vector<std::size_t> lowest;  // of each set
  std::vector<Box> boxes;
  const Eigen::Vector3d half = Eigen::Vector3d::Constant(distance / 2);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (sets.find(i) == i) {
      lowest.push_back(i);
      boxes.emplace_back(points[i] - half, points[i] + half);
    }
  }
  return visit_pairs(boxes, boxes, [&](int first, int second) {
    const std::size_t a = lowest[first];
    const std::size_t b = lowest[second];
    if ((points[a] - points[b]).norm() <= distance) {
      sets.unite(a, b);
    }
    return 1;
  });
}

}  // namespace

int weld(SurfaceMesh& mesh, double distance) {
  DisjointSets sets = equal_points(mesh.points);
  if (distance > 0 && !unite_near_points(sets, mesh.points, distance)) {
    throw Error("mesh.merge_distance: very many points lie within " + number_text(distance) +
                " m of each other, expected a shorter distance");
  }
  std::vector<int> target(mesh.points.size());
  int kept = 0;
  for (std::size_t i = 0; i < target.size(); ++i) {
    const std::size_t lowest = sets.find(i);
    target[i] = lowest == i ? kept++ : target[lowest];
  }
  const int removed = static_cast<int>(target.size()) - kept;
  if (removed > 0) {
    renumber_points(mesh, target);
  }
  return removed;
}

}  // namespace meshing
}  // namespace pellicle
