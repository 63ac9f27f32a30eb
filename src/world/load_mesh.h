#pragma once

#include <mpi.h>

#include <string>
#include <vector>

#include "meshing/checked_mesh.h"
#include "surface/point_set.h"
#include "world/options.h"

namespace pellicle {

/// Reads or generates the mesh on rank 0, checks it, repairs what can be repaired and scales it to its volume.
/// Collective.
/// @returns on rank 0 the mesh and its report, elsewhere empty ones
/// @throws Error, on all ranks, see make_checked_mesh
CheckedMesh load_mesh(MPI_Comm comm, const MeshOptions& options);

/// Refuses a mesh on which the run's chain cannot be built, or to which its textures cannot be put. Not collective.
/// @throws Error, one line that says what the mesh is like and all that is wrong
void require_fit(const CheckedMesh& checked, const Options& options);

/// What the log and the record of a run keep of its mesh: the summary, then repairs and warnings, each a line.
std::vector<std::string> mesh_lines(const MeshReport& report, ChainKind chain);

/// "ranks: 4; partition: edge cut 83, imbalance 1.010"
std::string partition_line(const PointSet& points);

}  // namespace pellicle
