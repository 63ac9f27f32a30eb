#include "elastic/sheet_geometry.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "geometry/pressure_load.h"
#include "surface/membrane.h"

namespace pellicle::elastic {

Eigen::Matrix3Xd warp_of(const Sheet& sheet, const Eigen::Vector3d& direction) {
  Eigen::Matrix3Xd normal = Eigen::Matrix3Xd::Zero(3, sheet.particles.local());
  for (const std::array<PetscInt, 3>& triangle : sheet.triangles) {
    const auto [e12, e13] = edges_of(sheet.rest.data(), triangle);
    for (const PetscInt i : triangle) {
      normal.col(i) += e12.cross(e13);
    }
  }
  normal.colwise().normalize();
  Eigen::Matrix3Xd warp(3, normal.cols());
  constexpr double upright = 1e-3;  // sine of the angle below which a direction counts as normal to the surface
  const Eigen::Vector3d wanted = direction.stableNormalized();
  const Eigen::Vector3d next(wanted.z(), wanted.x(), wanted.y());
  for (Eigen::Index i = 0; i < normal.cols(); ++i) {
    const Eigen::Vector3d n = normal.col(i);
    const Eigen::Vector3d in_plane = wanted - n.dot(wanted) * n;
    warp.col(i) = (in_plane.norm() > upright ? in_plane : Eigen::Vector3d(next - n.dot(next) * n)).normalized();
  }
  return warp;
}

std::vector<double> cell_areas(const Sheet& sheet) {
  std::vector<double> areas;
  for (const auto& [c0, c1, c2, c3] : sheet.cells) {
    areas.push_back(
        quad_area_vector(sheet.rest.col(c0), sheet.rest.col(c1), sheet.rest.col(c2), sheet.rest.col(c3)).norm());
  }
  return areas;
}

}  // namespace pellicle::elastic
