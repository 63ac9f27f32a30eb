#pragma once

#include <mpi.h>

#include <string>

#include "io/console.h"
#include "mesh/mesh_options.h"
#include "mesh/point_set.h"

namespace pellicle {

/// Reads or generates the mesh on rank 0, checks it, repairs what can be repaired, scales it to its volume, and tells
/// of it. Collective.
/// @returns on rank 0 the mesh, elsewhere an empty one @throws Error, on all ranks, see make_checked_mesh
SurfaceMesh load_mesh(MPI_Comm comm, const MeshOptions& options, Console& console);

/// "ranks: 4; partition: edge cut 83, imbalance 1.010"
std::string partition_line(const PointSet& points);

}  // namespace pellicle
