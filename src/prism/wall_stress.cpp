#include "prism/wall_stress.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace pellicle {
inline namespace prism {

namespace {

/// Eigenvalues of a 2x2 matrix with real eigenvalues, the larger first.
Eigen::Vector2d eigenvalues(const Eigen::Matrix2d& matrix) {
  const double mean = matrix.trace() / 2;
  // Not from the determinant: for nearly equal eigenvalues only rounding would be left.
  const double half = (matrix(0, 0) - matrix(1, 1)) / 2;
  const double radius = std::sqrt(std::max(0.0, half * half + matrix(0, 1) * matrix(1, 0)));
  return {mean + radius, mean - radius};
}

}  // namespace

PrincipalState principal_state(const Material& material, ThicknessRule rule, const RestMetric& rest,
                               const Eigen::Vector3d& e12, const Eigen::Vector3d& e13, double thickness_ratio) {
  const Eigen::Vector3d a = metric(e12, e13);
  const MetricEnergy state = metric_energy(material, rule, rest, a, thickness_ratio);
  const Eigen::Matrix2d deformed{{a[0], a[1]}, {a[1], a[2]}};
  const Eigen::Matrix2d inverse{{rest.inverse[0], rest.inverse[1]}, {rest.inverse[1], rest.inverse[2]}};
  // dU = S:dE V0 with E = (a - a0)/2, S by the undeformed edges; sigma = S a / J in mixed components.
  const Eigen::Matrix2d stress{{2 * state.gradient[0], state.gradient[1]}, {state.gradient[1], 2 * state.gradient[2]}};
  const double present_volume =
      rest.volume / rest.area * e12.cross(e13).norm() / 2 * state.thickness_ratio;  // of the prism
  return {eigenvalues(inverse * deformed).cwiseSqrt(), eigenvalues(stress * deformed / present_volume)};
}

Eigen::Matrix3d tension(const Eigen::Vector3d& gradient, const Eigen::Vector3d& e12, const Eigen::Vector3d& e13) {
  // N:d A = dU of a small strain d, by which the metric e_a.e_b changes by 2 e_a.d e_b.
  const Eigen::Matrix3d shear = gradient[1] * e12 * e13.transpose();
  const double area = e12.cross(e13).norm() / 2;
  return (2 * gradient[0] * e12 * e12.transpose() + shear + shear.transpose() +
          2 * gradient[2] * e13 * e13.transpose()) /
         area;
}

}  // namespace prism
}  // namespace pellicle
