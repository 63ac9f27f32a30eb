#pragma once

#include "meshing/surface_mesh.h"

namespace pellicle {
inline namespace meshing {

/// Renumbers the points: point i becomes `target[i]`, or is removed if that is negative. If several points get the same
/// new number the first gives the position. Faces, groups and point_id follow.
void renumber_points(SurfaceMesh& mesh, const std::vector<int>& target);

/// Merges all points that have exactly the same position into the one with the lowest number. @returns how many were
/// removed.
int weld(SurfaceMesh& mesh);

}  // namespace meshing
}  // namespace pellicle
