#include "surface/membrane_geometry.h"

#include <Eigen/Geometry>

#include "parallel/field.h"

namespace pellicle {
inline namespace surface {

std::vector<double> vertex_areas(const Membrane& membrane) {
  Field areas(membrane.particles, 1);
  for (const std::array<PetscInt, 3>& triangle : membrane.triangles) {
    const auto [e12, e13] = edges_of(membrane.rest.data(), triangle);
    const double area = e12.cross(e13).norm() / 2;
    for (const PetscInt corner : triangle) {
      areas.values()(0, corner) += area / 3;
    }
  }
  // Local elements are all that an owned vertex belongs to; a ghost misses some.
  areas.update_ghosts();
  return {areas.data(), areas.data() + membrane.particles.local()};
}

}  // namespace surface
}  // namespace pellicle
