#include "meshing/weld.h"

#include <algorithm>
#include <numeric>

#include "base/disjoint_sets.h"
#include "base/error.h"
#include "base/units.h"
#include "meshing/box_pairs.h"

namespace pellicle {
inline namespace meshing {

void renumber_points(SurfaceMesh& mesh, const std::vector<int>& target) {
  const int kept = 1 + *std::max_element(target.begin(), target.end());
  std::vector<Eigen::Vector3d> points(kept);
  std::vector<int> ids(kept);
  for (std::size_t i = target.size(); i-- > 0;) {
    if (target[i] >= 0) {
      const std::size_t to = target[i];
      points[to] = mesh.points[i];
      ids[to] = mesh.id_of_point(static_cast<int>(i));
    }
  }
  mesh.points = std::move(points);
  mesh.point_id = std::move(ids);
  for (std::vector<int>& face : mesh.faces) {
    for (int& point : face) {
      point = target[point];
    }
  }
  for (auto& entry : mesh.groups) {
    std::vector<int> members;
    for (const int point : entry.second) {
      if (target[point] >= 0) {
        members.push_back(target[point]);
      }
    }
    std::sort(members.begin(), members.end());
    members.erase(std::unique(members.begin(), members.end()), members.end());
    entry.second = std::move(members);
  }
}

namespace {

/// The points at the same place, exactly.
DisjointSets equal_points(const std::vector<Eigen::Vector3d>& points) {
  std::vector<int> order(points.size());
  std::iota(order.begin(), order.end(), 0);
  const auto at = [&points](int i) -> const Eigen::Vector3d& { return points[i]; };
  std::sort(order.begin(), order.end(), [&at](int a, int b) {
    for (int k = 0; k < 3; ++k) {
      if (at(a)[k] != at(b)[k]) {
        return at(a)[k] < at(b)[k];
      }
    }
    return a < b;
  });
  DisjointSets sets(points.size());
  for (std::size_t k = 1; k < order.size(); ++k) {
    if (at(order[k]) == at(order[k - 1])) {
      sets.unite(static_cast<std::size_t>(order[k]), static_cast<std::size_t>(order[k - 1]));
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
