#pragma once

#include <array>
#include <vector>

#include "meshing/surface_mesh.h"

namespace pellicle {
inline namespace meshing {

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

}  // namespace meshing
}  // namespace pellicle
