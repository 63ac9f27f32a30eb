#pragma once

#include "meshing/surface_mesh.h"

namespace pellicle {
inline namespace meshing {

/// Renumbers the points: point i becomes `target[i]`, or is removed if that is negative. If several points get the same
/// new number the first gives the position. Faces, groups and point_id follow.
void renumber_points(SurfaceMesh& mesh, const std::vector<int>& target);

/// Merges all points that are no further apart than `distance` [m], also by others between them, into the one with the
/// lowest number. @returns how many were removed
/// @throws Error if so many are so near that all pairs cannot be looked at
int weld(SurfaceMesh& mesh, double distance = 0);

}  // namespace meshing
}  // namespace pellicle
