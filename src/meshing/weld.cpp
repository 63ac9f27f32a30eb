#include "meshing/weld.h"

#include <algorithm>
#include <numeric>

namespace pellicle {
inline namespace meshing {

void renumber_points(SurfaceMesh& mesh, const std::vector<int>& target) {
  const int kept = 1 + *std::max_element(target.begin(), target.end());
  std::vector<Eigen::Vector3d> points(static_cast<std::size_t>(kept));
  std::vector<int> ids(static_cast<std::size_t>(kept));
  for (std::size_t i = target.size(); i-- > 0;) {
    if (target[i] >= 0) {
      const auto to = static_cast<std::size_t>(target[i]);
      points[to] = mesh.points[i];
      ids[to] = mesh.id_of_point(static_cast<int>(i));
    }
  }
  mesh.points = std::move(points);
  mesh.point_id = std::move(ids);
  for (std::vector<int>& face : mesh.faces) {
    for (int& point : face) {
      point = target[static_cast<std::size_t>(point)];
    }
  }
  for (auto& entry : mesh.groups) {
    std::vector<int> members;
    for (const int point : entry.second) {
      if (target[static_cast<std::size_t>(point)] >= 0) {
        members.push_back(target[static_cast<std::size_t>(point)]);
      }
    }
    std::sort(members.begin(), members.end());
    members.erase(std::unique(members.begin(), members.end()), members.end());
    entry.second = std::move(members);
  }
}

int weld(SurfaceMesh& mesh) {
  const std::vector<Eigen::Vector3d>& points = mesh.points;
  std::vector<int> order(points.size());
  std::iota(order.begin(), order.end(), 0);
  const auto at = [&points](int i) -> const Eigen::Vector3d& { return points[static_cast<std::size_t>(i)]; };
  std::sort(order.begin(), order.end(), [&at](int a, int b) {
    for (int k = 0; k < 3; ++k) {
      if (at(a)[k] != at(b)[k]) {
        return at(a)[k] < at(b)[k];
      }
    }
    return a < b;
  });
  // The first of each run of equal points stands for all of them.
  std::vector<int> first(points.size());
  int removed = 0;
  for (std::size_t k = 0; k < order.size(); ++k) {
    const bool repeats = k > 0 && at(order[k]) == at(order[k - 1]);
    first[static_cast<std::size_t>(order[k])] = repeats ? first[static_cast<std::size_t>(order[k - 1])] : order[k];
    removed += repeats ? 1 : 0;
  }
  if (removed == 0) {
    return 0;
  }
  std::vector<int> target(points.size());
  int next = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const bool stands = first[i] == static_cast<int>(i);
    target[i] = stands ? next++ : target[static_cast<std::size_t>(first[i])];
  }
  renumber_points(mesh, target);
  return removed;
}

}  // namespace meshing
}  // namespace pellicle
