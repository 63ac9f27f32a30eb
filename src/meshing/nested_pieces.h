#pragma once

#include <array>
#include <vector>

#include "meshing/surface_mesh.h"

namespace pellicle {
inline namespace meshing {

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

}  // namespace meshing
}  // namespace pellicle
