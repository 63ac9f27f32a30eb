#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "geometry/box_tree.h"
#include "geometry/triangle_intersection.h"
#include "parallel/field.h"
#include "surface/surface.h"

namespace pellicle::contact {

/// Crossings and contacts of drawn surfaces with themselves and each other.
struct Crossings {
  int pairs = 0;                       ///< of triangles that cut through each other
  int touching = 0;                    ///< of triangles that only touch (find_crossings)
  std::array<PetscInt, 2> elements{};  ///< of the first pair, by their numbers in the file
  std::array<int, 2> surfaces{};       ///< numbers of the surfaces with these elements
  Eigen::Vector3d place{0, 0, 0};      ///< of the first of the two elements [m]
};

/// A surface that is examined.
struct PlacedSurface {
  const Surface& surface;
  const Field& position;
  const std::vector<bool>* active;  ///< of its surface triangles; null: all of them
};

/// Counts the pairs of surface triangles without a common corner that cut through each other, all on rank 0, by a test
/// that has nothing in common with SurfaceContact (count_self_intersections). Collective.
/// @param surfaces at least one
/// @param touch distance below which other pairs of triangles touch [m]; 0: these are not looked for. A corner and a
/// triangle, or two edges, touch, and so do two triangles of which one lies on the other; where corners are in one
/// place, as on both sides of a slit, that alone does not count.
Crossings find_crossings(const std::vector<PlacedSurface>& surfaces, double touch = 0);

/// Whether two triangles touch as find_crossings defines it.
bool triangles_touch(const Triangle& first, const Triangle& second, double touch);

/// The places of a triangle's points.
inline Triangle corners_of(const std::vector<Eigen::Vector3d>& points, const std::array<int, 3>& triangle) {
  return {points[triangle[0]], points[triangle[1]], points[triangle[2]]};
}

/// Calls `take` with the numbers of every two triangles whose boxes are apart by no more than `reach` [m], once, in any
/// order.
template <class Take>
void visit_near_pairs(const std::vector<Eigen::Vector3d>& points, const std::vector<std::array<int, 3>>& triangles,
                      double reach, const Take& take) {
  std::vector<Bounds> boxes;
  for (const auto& [a, b, c] : triangles) {
    const Eigen::AlignedBox3d box = Eigen::AlignedBox3d(points[a]).extend(points[b]).extend(points[c]);
    boxes.emplace_back(Eigen::AlignedBox3d(box.min().array() - reach / 2, box.max().array() + reach / 2));
  }
  BoxTree(boxes).visit_pairs(take);
}

/// Counts the pairs of triangles that cut through each other now and not before. Collective.
/// @param before the same triangles at other places
Crossings find_new_crossings(const std::vector<PlacedSurface>& before, const std::vector<PlacedSurface>& surfaces);

/// "3 pairs of triangles pass through each other, first of elements 4 and 9 at (1, 0, 2) m". @param names of the
/// examined objects, empty for those that the words do not name
std::string crossing_words(const Crossings& crossings, const std::vector<std::string>& names);

}  // namespace pellicle::contact
