#pragma once

#include <array>
#include <vector>

#include "meshing/surface_mesh.h"

namespace pellicle {
inline namespace meshing {

/// Where the boundary of a mesh runs along itself, so that faces which look joined are not.
struct Slits {
  int near_points = 0;        ///< points of the boundary that nearly are at the place of another
  double largest_gap = 0;     ///< between two of these [m]
  std::vector<int> on_sides;  ///< points that lie on sides of faces which do not have them, rising
};

/// Finds the slits of a mesh. Near means within 1e-6 of the sides there, or of the largest coordinate if that is more
/// (text often has six digits), but at most 1e-3 of the sides.
/// @param boundary the points of each side that has one face
Slits find_slits(const SurfaceMesh& mesh, const std::vector<std::array<int, 2>>& boundary);

}  // namespace meshing
}  // namespace pellicle
