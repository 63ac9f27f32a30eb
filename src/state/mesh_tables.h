#pragma once

#include <string>

#include "state/hdf5_file.h"
#include "surface/mesh_rows.h"

namespace pellicle::state {

// A distributed mesh as tables of a file, in the order of the ids: GROUP/vertices/id, position [m], uv, group_set, and
// for a sheet mass [kg], since a corner keeps its mass when compaction removes some of its cells; GROUP/cells/id,
// corners (ids of vertices), rank (of each cell), uv, group_set, and a table for each field of the mesh, FIELD_number.

/// Writes the rows of a mesh, which may be on any ranks. Collective. @throws Error, on all ranks
void write_mesh(Hdf5File& file, const std::string& group, const MeshRows& rows);

/// Reads the rows of a mesh: of each table this rank's share. If the number of ranks is that of the run that wrote it,
/// MeshRows::part is set. Collective. @throws Error, on all ranks
MeshRows read_mesh(const Hdf5File& file, const std::string& group);

}  // namespace pellicle::state
