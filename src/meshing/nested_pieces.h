#pragma once

#include <array>
#include <vector>

#include "meshing/surface_mesh.h"

namespace pellicle {
inline namespace meshing {

/// Closed pieces of a mesh that lie inside others.
struct NestedPieces {
  int count = 0;                   ///< of the pieces that do
  std::array<int, 2> first{0, 0};  ///< the lowest point of the first of them, and that of a piece round it
};

/// @param mesh no two pieces have a point in common
/// @param triangles all its faces, facing outward in closed pieces
/// @param boundary the points of each side that has one face
NestedPieces find_nested_pieces(const SurfaceMesh& mesh, const std::vector<std::array<int, 3>>& triangles,
                                const std::vector<std::array<int, 2>>& boundary);

}  // namespace meshing
}  // namespace pellicle
