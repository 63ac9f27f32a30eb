#pragma once

#include <string>

#include "state/hdf5_file.h"
#include "surface/mesh_rows.h"

namespace pellicle {
inline namespace state {

// A distributed mesh as tables of a file, in the order of the ids: GROUP/vertices/id, position [m], uv, group_set, and
// of a sheet mass [kg], which compaction leaves a corner that has lost cells; GROUP/cells/id, corners (ids of
// vertices), rank (to which each belongs), uv, and a table for each field of the mesh, FIELD_name.

/// Writes the rows of a mesh, whatever ranks they are on. Collective. @throws Error, on all ranks
void write_mesh(Hdf5File& file, const std::string& group, const MeshRows& rows);

/// Reads the rows of a mesh: of each table this rank's share. On as many ranks as have written it the cells know their
/// ranks (MeshRows::part). Collective. @throws Error, on all ranks
MeshRows read_mesh(const Hdf5File& file, const std::string& group);

}  // namespace state
}  // namespace pellicle
