#include "geometry/pressure_load.h"

#include <Eigen/Geometry>

namespace pellicle {
inline namespace geometry {

double enclosed_volume(const Eigen::Vector3d& x1, const Eigen::Vector3d& x2, const Eigen::Vector3d& x3) {
  return x1.dot(x2.cross(x3)) / 6;
}

Eigen::Vector3d area_vector(const Eigen::Vector3d& x1, const Eigen::Vector3d& x2, const Eigen::Vector3d& x3) {
  return 0.5 * (x2 - x1).cross(x3 - x1);
}

void add_pressure_stiffness_action(double pressure, const Eigen::Vector3d x[3], const Eigen::Vector3d w[3],
                                   Eigen::Vector3d result[3]) {
  // Of f_1 = (p/6) x2 x x3 and the others in turn.
  const double factor = pressure / 6;
  result[0] += factor * (x[2].cross(w[1]) - x[1].cross(w[2]));
  result[1] += factor * (x[0].cross(w[2]) - x[2].cross(w[0]));
  result[2] += factor * (x[1].cross(w[0]) - x[0].cross(w[1]));
}

}  // namespace geometry
}  // namespace pellicle
