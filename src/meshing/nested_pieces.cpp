#include "meshing/nested_pieces.h"

#include <map>

#include "base/disjoint_sets.h"
#include "geometry/pi.h"
#include "geometry/pressure_load.h"
#include "meshing/box_pairs.h"

namespace pellicle {
inline namespace meshing {

NestedPieces find_nested_pieces(const SurfaceMesh& mesh, const std::vector<std::array<int, 3>>& triangles,
                                const std::vector<std::array<int, 2>>& boundary) {
  const auto at = [&mesh](int point) -> const Eigen::Vector3d& { return mesh.points[point]; };
  DisjointSets sets(mesh.points.size());
  for (const auto& [a, b, c] : triangles) {
    sets.unite(static_cast<std::size_t>(a), static_cast<std::size_t>(b));
    sets.unite(static_cast<std::size_t>(b), static_cast<std::size_t>(c));
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
        piece.box.extend(at(point));
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
      angle += solid_angle(at(i) - at(a.point), at(j) - at(a.point), at(k) - at(a.point));
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

}  // namespace meshing
}  // namespace pellicle
