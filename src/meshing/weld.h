#pragma once

#include "meshing/surface_mesh.h"

namespace pellicle {
inline namespace meshing {

/// Merges points no further apart than `distance` [m], also through points between them, into the one of the lowest
/// number. @returns the number of removed points
/// @throws Error if so many points are so near that not all pairs can be compared
int weld(SurfaceMesh& mesh, double distance = 0);

}  // namespace meshing
}  // namespace pellicle
