#include "meshing/checked_mesh.h"

#include <cmath>

#include "base/error.h"

namespace pellicle {
inline namespace meshing {

CheckedMesh make_checked_mesh(const MeshOptions& options) {
  CheckedMesh checked;
  auto& [mesh, report] = checked;
  mesh = make_mesh(options);
  report = check_and_repair(mesh, options.name(), options.merge ? std::optional(options.merge_distance) : std::nullopt);
  if (!options.volume) {
    return checked;
  }
  if (report.boundary_edges > 0) {
    throw Error("mesh.volume: " + report.summary() + "; expected a closed mesh");
  }
  if (!(report.volume > 0)) {
    throw Error("mesh.volume: " + options.name() + " encloses no volume, expected a mesh that does");
  }
  const double factor = std::cbrt(*options.volume / report.volume);
  for (Eigen::Vector3d& point : mesh.points) {
    point = options.shift + factor * (point - options.shift);
  }
  require_coordinates(mesh, options.name());
  measure_rounding(mesh, report);
  report.volume = *options.volume;
  report.area *= factor * factor;
  report.shortest_edge *= factor;
  report.longest_edge *= factor;
  return checked;
}

}  // namespace meshing
}  // namespace pellicle
