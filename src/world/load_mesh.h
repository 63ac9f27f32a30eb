#pragma once

#include <mpi.h>

#include <string>
#include <vector>

#include "surface/mesh_rows.h"
#include "surface/surface.h"
#include "world/options.h"

namespace pellicle::world {

/// A mesh as rows, and the lines that describe it.
struct LoadedMesh {
  MeshRows rows;
  std::vector<std::string> lines;    ///< for the log and the record of a run: the summary, then repairs and warnings
  std::vector<std::string> figures;  ///< MeshReport::quality; none of a file that has been checked before
};

/// Loads the mesh of a run. Either reads or generates it on rank 0, and for the inflating chain splits its faces into
/// triangles; or reads on each rank its fraction of a file of `-mesh_only`, which is checked and in its place already.
/// Collective.
/// @throws Error, on all ranks; with `-mesh_only` no mesh is refused because the chain cannot be built on it
LoadedMesh load_mesh(MPI_Comm comm, const Options& options);

/// The group of the tables of a mesh in a file of `-mesh_only`.
inline constexpr const char* mesh_file_group = "mesh";

/// "ranks: 4; partition: edge cut 83, imbalance 1.010"
std::string partition_line(const Surface& points);

}  // namespace pellicle::world
