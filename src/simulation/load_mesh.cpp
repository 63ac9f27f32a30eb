#include "simulation/load_mesh.h"

#include <cstdio>
#include <utility>

#include "base/error.h"
#include "mesh/checked_mesh.h"

namespace pellicle {

SurfaceMesh load_mesh(MPI_Comm comm, const MeshOptions& options, Console& console) {
  CheckedMesh checked;
  on_root(comm, [&] { checked = make_checked_mesh(options); });
  for (const std::string& line : checked.report.lines()) {
    console.say(line);
  }
  return std::move(checked.mesh);
}

std::string partition_line(const PointSet& points) {
  int ranks = 1;
  MPI_Comm_size(points.comm(), &ranks);
  char text[120];
  std::snprintf(text, sizeof text, "ranks: %d; partition: edge cut %d, imbalance %.3f", ranks,
                static_cast<int>(points.partition.edge_cut), points.partition.imbalance);
  return text;
}

}  // namespace pellicle
