#include "prism/gradient_kernel.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

namespace pellicle {
inline namespace prism {

namespace {

constexpr double half_root = 0.70710678118654752440;  // sqrt(1/2)

/// (S_i - S_3)/(C_i - C_3) for the in-plane principal axis i with C_i = x; y is the other in-plane value, z = C_3.
/// @param p Lagrange multiplier of the element's volume: S = ... - p C^-1
double shear_modulus(const EnergyDensity& psi, double p, double x, double y, double z) {
  const auto& [by_t, by_d, by_c] = psi.gradient;
  const double constraint = p / (x * z);
  if (std::abs(x - z) > 1e-5 * (x + z)) {
    return 2 * (by_t + by_d * y - by_c) / (x - z) + constraint;
  }
  // Where they coincide: S_i = 2 dpsi/dC_i, and the quotient's limit is the second difference of psi.
  const auto& h = psi.hessian;
  const double xx = h[0][0] + 2 * y * h[0][1] + y * y * h[1][1];
  const double xz = h[0][2] + y * h[1][2];
  return xx - 2 * xz + h[2][2] + constraint;
}

/// The transverse shear moduli as a tensor: isotropic materials have them in the principal axes of C.
Eigen::Matrix2d shear_moduli(const EnergyDensity& psi, double p, const Eigen::Matrix2d& green, double c) {
  const double mean = green.trace() / 2;
  const double radius = std::hypot((green(0, 0) - green(1, 1)) / 2, green(0, 1));
  const double larger = mean + radius, smaller = mean - radius;
  const double first = shear_modulus(psi, p, larger, smaller, c);
  if (radius < 1e-10 * mean) {
    return first * Eigen::Matrix2d::Identity();
  }
  const double second = shear_modulus(psi, p, smaller, larger, c);
  const Eigen::Matrix2d deviator = (green - mean * Eigen::Matrix2d::Identity()) / radius;
  return (first + second) / 2 * Eigen::Matrix2d::Identity() + (first - second) / 2 * deviator;
}

}  // namespace

GradientElement gradient_element(const Material& material, ThicknessRule rule, const RestMetric& rest,
                                 const Eigen::Vector3d& e12, const Eigen::Vector3d& e13, double given_ratio) {
  const MetricEnergy energy = metric_energy(material, rule, rest, metric(e12, e13), given_ratio);
  const double ratio = energy.thickness_ratio;

  GradientElement element;
  element.volume = rest.volume;
  element.inverse_edges = inverse_edges(rest);
  element.gradient.leftCols<2>() << e12, e13;
  element.gradient.leftCols<2>() *= element.inverse_edges;
  element.gradient.col(2) = ratio * e12.cross(e13).normalized();

  const Eigen::Matrix2d green = element.gradient.leftCols<2>().transpose() * element.gradient.leftCols<2>();
  const double c = ratio * ratio;
  const EnergyDensity psi = energy_density(material, green.trace(), green.determinant(), c);
  // S across the wall is 2 dpsi/dc; if the volume is kept constant, that balances it.
  const double p = rule == ThicknessRule::incompressible ? 2 * psi.gradient[2] * c : 0;
  element.shear = shear_moduli(psi, p, green, c);

  // The in-plane part follows from U(a): dU = V/2 S : dC.
  const Eigen::Matrix3d inverse = cauchy_green_of_metric(rest).inverse();
  const Eigen::Vector3d s = 2 / rest.volume * inverse.transpose() * energy.gradient;
  element.stress << s[0], half_root * s[2], 0, half_root * s[2], s[1], 0, 0, 0, 2 * psi.gradient[2] - p / c;
  element.stiffness = 4 / rest.volume * inverse.transpose() * energy.hessian * inverse;
  return element;
}

void gradient_action(const GradientElement& element, Director director, const Eigen::Vector3d w[3],
                     Eigen::Vector3d df[3]) {
  const Eigen::Matrix2d& r = element.inverse_edges;
  const auto f1 = element.gradient.col(0), f2 = element.gradient.col(1), f3 = element.gradient.col(2);
  const Eigen::Vector3d e12 = w[1] - w[0];
  const Eigen::Vector3d df1 = r(0, 0) * e12;
  const Eigen::Vector3d df2 = r(0, 1) * e12 + r(1, 1) * (w[2] - w[0]);

  const Eigen::Vector3d de(f1.dot(df1), f2.dot(df2), half_root * (f1.dot(df2) + f2.dot(df1)));
  const Eigen::Vector3d ds = element.stiffness * de;
  const double ds12 = half_root * ds[2];
  const Eigen::Matrix3d& s = element.stress;
  Eigen::Vector3d dp1 = s(0, 0) * df1 + s(0, 1) * df2 + ds[0] * f1 + ds12 * f2;
  Eigen::Vector3d dp2 = s(0, 1) * df1 + s(1, 1) * df2 + ds12 * f1 + ds[1] * f2;
  if (director == Director::left_out) {
    const Eigen::Vector2d ds3 = element.shear * Eigen::Vector2d(f3.dot(df1), f3.dot(df2));
    dp1 += ds3[0] * f3;
    dp2 += ds3[1] * f3;
  }
  // The third column does no work: the director's changes are normal to it.
  df[1] = -element.volume * (r(0, 0) * dp1 + r(0, 1) * dp2);
  df[2] = -element.volume * r(1, 1) * dp2;
  df[0] = -df[1] - df[2];
}

}  // namespace prism
}  // namespace pellicle
