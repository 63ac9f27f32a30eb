#include "simulation/load_mesh.h"

#include <cstdio>

#include "base/error.h"
#include "mesh/mesh_check.h"

namespace pellicle {

SurfaceMesh load_mesh(MPI_Comm comm, const MeshOptions& options, Console& console) {
  SurfaceMesh mesh;
  MeshReport report;
  on_root(comm, [&] {
    mesh = make_mesh(options);
    report = check_and_repair(mesh, options.name());
  });
  for (const std::string& line : report.lines()) {
    console.say(line);
  }
  return mesh;
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
