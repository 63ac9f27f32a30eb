#pragma once

#include "meshing/surface_mesh.h"

namespace pellicle {
inline namespace meshing {

/// Numbers the points anew: point i becomes `target[i]`, or goes if that is negative. Of several points with one new
/// number the first gives the position. Faces, groups and point_id follow.
void renumber_points(SurfaceMesh& mesh, const std::vector<int>& target);

/// Makes one point of all that have exactly the same position, the one with the lowest number. @returns how many went.
int weld(SurfaceMesh& mesh);

}  // namespace meshing
}  // namespace pellicle
