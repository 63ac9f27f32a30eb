#pragma once

#include "meshing/mesh_check.h"
#include "meshing/mesh_options.h"
#include "meshing/surface_mesh.h"

namespace pellicle {
inline namespace meshing {

struct CheckedMesh {
  SurfaceMesh mesh;
  MeshReport report;
};

/// Makes the mesh of the options, checks and repairs it, and scales it to the given volume, about the origin of the
/// file's coordinates. Not collective.
/// @throws Error as make_mesh and check_and_repair do, and if a volume is given for an open mesh
CheckedMesh make_checked_mesh(const MeshOptions& options);

}  // namespace meshing
}  // namespace pellicle
