#include "meshing/overlaps.h"

#include <algorithm>
#include <map>

#include "base/disjoint_sets.h"
#include "base/sorting.h"
#include "geometry/pi.h"
#include "geometry/pressure_load.h"
#include "geometry/triangle_intersection.h"
#include "meshing/box_pairs.h"

namespace pellicle::meshing {

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
  std::vector<Box> boxes;
  for (const std::array<int, 3>& triangle : triangles) {
    Box& box = boxes.emplace_back();
    for (const int point : triangle) {
      box.extend(points[point]);
    }
  }
  SelfIntersections found;
  found.all = visit_pairs(boxes, boxes, [&](int a, int b) {
    if (a >= b || have_common_point(triangles[a], triangles[b])) {
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

Slits find_slits(const SurfaceMesh& mesh, const std::vector<std::array<int, 2>>& boundary) {
  const std::vector<Eigen::Vector3d>& at = mesh.points;
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
      longest = std::max(longest, (at[b] - at[a]).norm());
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

  Slits slits;
  std::vector<bool> is_near(mesh.points.size(), false);
  visit_pairs(round_points, round_points, [&](int first, int second) {
    const int a = points[first];
    const int b = points[second];
    const double gap = (at[a] - at[b]).norm();
    if (a != b && gap > 0 && gap <= std::min(reach[a], reach[b])) {
      is_near[a] = is_near[b] = true;
      slits.largest_gap = std::max(slits.largest_gap, gap);
    }
    return 1;
  });
  slits.near_points = static_cast<int>(std::count(is_near.begin(), is_near.end(), true));

  std::vector<Box> round_sides;
  for (const auto& [a, b] : boundary) {
    Box box(at[a]);
    box.extend(at[b]);
    const Eigen::Vector3d margin = Eigen::Vector3d::Constant(std::max(reach[a], reach[b]));
    round_sides.emplace_back(box.min() - margin, box.max() + margin);
  }
  visit_pairs(round_points, round_sides, [&](int number, int side) {
    const int point = points[number];
    const auto& [a, b] = boundary[side];
    const Eigen::Vector3d along = at[b] - at[a];
    const double length = along.norm();
    const double place = (at[point] - at[a]).dot(along) / length;  // [m] from a
    const double near = std::min({reach[point], reach[a], reach[b]});
    if (place > near && place < length - near && (at[point] - at[a] - place / length * along).norm() <= near) {
      slits.on_sides.push_back(point);
    }
    return 1;
  });
  slits.on_sides = without_repeats(std::move(slits.on_sides));
  return slits;
}

NestedPieces find_nested_pieces(const SurfaceMesh& mesh, const std::vector<std::array<int, 3>>& triangles,
                                const std::vector<std::array<int, 2>>& boundary) {
  const std::vector<Eigen::Vector3d>& at = mesh.points;
  DisjointSets sets(mesh.points.size());
  for (const auto& [a, b, c] : triangles) {
    sets.unite(a, b);
    sets.unite(b, c);
  }
  struct Piece {
    int point = 0;  ///< its lowest
    Box box;
    std::vector<std::array<int, 3>> triangles;
  };
  std::vector<bool> is_open(mesh.points.size(), false);  // of the lowest point of a piece
  for (const std::array<int, 2>& side : boundary) {
    is_open[sets.find(side[0])] = true;
  }
  std::map<std::size_t, Piece> closed;
  for (const std::array<int, 3>& triangle : triangles) {
    const std::size_t lowest = sets.find(triangle[0]);
    if (!is_open[lowest]) {
      Piece& piece = closed[lowest];
      piece.point = static_cast<int>(lowest);
      piece.triangles.push_back(triangle);
      for (const int point : triangle) {
        piece.box.extend(at[point]);
      }
    }
  }
  std::vector<Piece> pieces;
  std::vector<Box> boxes;
  for (auto& entry : closed) {
    boxes.push_back(entry.second.box);
    pieces.push_back(std::move(entry.second));
  }
  std::vector<int> round(pieces.size(), -1);  // of each piece the lowest point of one round it
  visit_pairs(boxes, boxes, [&](int inner, int outer) {
    const Piece& a = pieces[inner];
    const Piece& b = pieces[outer];
    if (inner == outer || round[inner] >= 0 || !b.box.contains(a.box)) {
      return 1;
    }
    double angle = 0;  // 4 pi seen from inside, 0 from outside
    for (const auto& [i, j, k] : b.triangles) {
      angle += solid_angle(at[i] - at[a.point], at[j] - at[a.point], at[k] - at[a.point]);
    }
    if (angle > 2 * pi) {
      round[inner] = b.point;
    }
    return static_cast<int>(b.triangles.size());
  });
  NestedPieces nested;
  for (std::size_t k = 0; k < round.size(); ++k) {
    if (round[k] >= 0 && ++nested.count == 1) {
      nested.first = {pieces[k].point, round[k]};
    }
  }
  return nested;
}

}  // namespace pellicle::meshing
