#include "geometry/pressure_load.h"

#include <Eigen/Geometry>
#include <cmath>

#include "geometry/cross_matrix.h"

namespace pellicle {
inline namespace geometry {

double solid_angle(const Eigen::Vector3d& x1, const Eigen::Vector3d& x2, const Eigen::Vector3d& x3) {
  const double r1 = x1.norm();
  const double r2 = x2.norm();
  const double r3 = x3.norm();
  return 2 * std::atan2(x1.dot(x2.cross(x3)), r1 * r2 * r3 + x1.dot(x2) * r3 + x2.dot(x3) * r1 + x3.dot(x1) * r2);
}

void add_pressure_stiffness_action(double pressure, const Eigen::Vector3d x[3], const Eigen::Vector3d w[3],
                                   Eigen::Vector3d result[3]) {
  const Eigen::Vector3d product = pressure / 6 * ((x[2] - x[0]).cross(w[1] - w[0]) - (x[1] - x[0]).cross(w[2] - w[0]));
  for (int corner = 0; corner < 3; ++corner) {
    result[corner] += product;
  }
}

Eigen::Matrix3d rim_stiffness(double pressure, const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  return cross_matrix(-pressure / 12 * (to - from));
}

}  // namespace geometry
}  // namespace pellicle
