#include "geometry/pressure_load.h"

#include <Eigen/Geometry>

namespace pellicle {

double enclosed_volume(const Eigen::Vector3d& x1, const Eigen::Vector3d& x2, const Eigen::Vector3d& x3) {
  return x1.dot(x2.cross(x3)) / 6;
}

Eigen::Vector3d area_vector(const Eigen::Vector3d& x1, const Eigen::Vector3d& x2, const Eigen::Vector3d& x3) {
  return 0.5 * (x2 - x1).cross(x3 - x1);
}

Eigen::Matrix<double, 9, 9> pressure_stiffness(double pressure, const Eigen::Vector3d& x1, const Eigen::Vector3d& x2,
                                               const Eigen::Vector3d& x3) {
  // With f_1 = (p/6) x2 x x3 and [a] b = a x b: df_1/dx2 = -(p/6) [x3], df_1/dx3 = (p/6) [x2]; the rest in turn.
  const auto cross_matrix = [factor = pressure / 6](const Eigen::Vector3d& a) {
    Eigen::Matrix3d matrix;
    matrix << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
    return Eigen::Matrix3d(factor * matrix);
  };
  const Eigen::Matrix3d of_x1 = cross_matrix(x1);
  const Eigen::Matrix3d of_x2 = cross_matrix(x2);
  const Eigen::Matrix3d of_x3 = cross_matrix(x3);
  Eigen::Matrix<double, 9, 9> stiffness = Eigen::Matrix<double, 9, 9>::Zero();
  stiffness.block<3, 3>(0, 3) = of_x3;
  stiffness.block<3, 3>(3, 0) = -of_x3;
  stiffness.block<3, 3>(3, 6) = of_x1;
  stiffness.block<3, 3>(6, 3) = -of_x1;
  stiffness.block<3, 3>(6, 0) = of_x2;
  stiffness.block<3, 3>(0, 6) = -of_x2;
  return stiffness;
}

void add_pressure_stiffness_action(double pressure, const Eigen::Vector3d x[3], const Eigen::Vector3d w[3],
                                   Eigen::Vector3d result[3]) {
  const double factor = pressure / 6;
  result[0] += factor * (x[2].cross(w[1]) - x[1].cross(w[2]));
  result[1] += factor * (x[0].cross(w[2]) - x[2].cross(w[0]));
  result[2] += factor * (x[1].cross(w[0]) - x[0].cross(w[1]));
}

}  // namespace pellicle
