#include "mesh/membrane_geometry.h"

#include <Eigen/Geometry>

#include "mesh/field.h"

namespace pellicle {

std::vector<double> vertex_areas(const Membrane& membrane) {
  Field areas(membrane.particles, 1);
  for (const auto& [a, b, c] : membrane.triangles) {
    const Eigen::Vector3d first = membrane.rest.col(a);
    const double area = (membrane.rest.col(b) - first).cross(membrane.rest.col(c) - first).norm() / 2;
    for (const PetscInt corner : {a, b, c}) {
      areas.values()(0, corner) += area / 3;
    }
  }
  // Local elements are all that an owned vertex belongs to; a ghost misses some.
  areas.update_ghosts();
  return {areas.data(), areas.data() + membrane.particles.local()};
}

}  // namespace pellicle
