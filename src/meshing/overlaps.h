#pragma once

#include <array>
#include <vector>

#include "meshing/surface_mesh.h"

namespace pellicle::meshing {

// Parts of a mesh that cut each other, touch and are not joined, or lie inside each other.

/// Pairs of triangles that cut through each other.
struct SelfIntersections {
  int pairs = 0;
  std::array<int, 2> first{-1, -1};  ///< pair with the lowest numbers
  bool all = true;                   ///< false if the count was ended because too many boxes of triangles overlap
};

/// Counts the pairs of triangles that cut through each other (triangles_intersect); triangles with a common point are
/// left out. By a tree of bounding boxes, whose cost is n log n for surfaces; where nearly all of them overlap, as of a
/// heap of long needles, the count ends after the work of some hundred pairs of boxes a triangle, and at least 10^8.
SelfIntersections count_self_intersections(const std::vector<Eigen::Vector3d>& points,
                                           const std::vector<std::array<int, 3>>& triangles);

/// Slits of a mesh: its boundary runs along itself, so that faces look joined and are not.
struct Slits {
  int near_points = 0;        ///< points of the boundary that nearly coincide with another
  double largest_gap = 0;     ///< between two such points [m]
  std::vector<int> on_sides;  ///< points on sides of faces without them, ascending
};

/// Finds the slits of a mesh. Near means within 1e-6 of the sides there, or of the largest coordinate if that is more
/// (text often has six digits), but at most 1e-3 of the sides.
/// @param boundary the points of each side that has one face
Slits find_slits(const SurfaceMesh& mesh, const std::vector<std::array<int, 2>>& boundary);

/// Closed pieces of a mesh that lie inside others.
struct NestedPieces {
  int count = 0;                   ///< number of nested pieces
  std::array<int, 2> first{0, 0};  ///< lowest points of the first nested piece and of one round it
};

/// Finds nested pieces. @param mesh whose pieces have no common points
/// @param triangles all its faces, facing outward in closed pieces
/// @param boundary the points of each side that has one face
NestedPieces find_nested_pieces(const SurfaceMesh& mesh, const std::vector<std::array<int, 3>>& triangles,
                                const std::vector<std::array<int, 2>>& boundary);

}  // namespace pellicle::meshing
