#include "prism/gradient_stiffness.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "base/log_event.h"
#include "geometry/pressure_load.h"
#include "surface/membrane.h"

namespace pellicle::prism {

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

// Operations an element: of gradient_action (edges, strain, stress, forces; the shear stress where the director is left
// out), and of the pressure.
double product_flops(Director director, bool has_pressure) {
  return 18 + 22 + 58 + 22 + (director == Director::left_out ? 28 : 0) + (has_pressure ? 1 + 12 + 2 * 9 + 6 + 9 : 0);
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
                     Eigen::Vector3d product[3]) {
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
  product[1] = element.volume * (r(0, 0) * dp1 + r(0, 1) * dp2);
  product[2] = element.volume * r(1, 1) * dp2;
  product[0] = -product[1] - product[2];
}

GradientStiffness::GradientStiffness(const PrismElements& elements, Director director)
    : elements_(&elements), director_(director), linearised_(elements.membrane().triangles.size()) {}

void GradientStiffness::update(const Field& positions, const std::vector<double>& thickness_ratio,
                               const std::vector<double>& pressure, double /*left_out*/) {
  const Wall& wall = elements_->wall();
  static const PetscLogEvent event = log_event("PrismStiffness");
  // Besides the energy, inverse edges and F, C, the shear moduli (which evaluate the density again), and stress and
  // stiffness by the inverse of a matrix (3 x 3).
  double flops = elements_->tangent_flops() + (6 + 18 + 21 + 24 + 40 + 163.0) * static_cast<double>(linearised_.size());
  for (std::size_t e = 0; e < linearised_.size(); ++e) {
    flops += energy_density_flops(wall.material_of(e));
  }
  const LogScope scope(event, flops);
  for (std::size_t e = 0; e < linearised_.size(); ++e) {
    if (elements_->stiffness(e) == 0) {
      continue;
    }
    const auto [e12, e13] = edges_of(positions.data(), elements_->membrane().triangles[e]);
    linearised_[e] = gradient_element(wall.material_of(e), wall.rule, elements_->rest(e), e12, e13, thickness_ratio[e]);
    linearised_[e].volume *= elements_->stiffness(e);
  }
  positions_ = positions.values();
  pressure_ = pressure;
}

void GradientStiffness::multiply(std::size_t element, const Eigen::Vector3d w[3], Eigen::Vector3d result[3]) const {
  if (elements_->stiffness(element) == 0) {
    std::fill_n(result, 3, Eigen::Vector3d::Zero());
    return;
  }
  gradient_action(linearised_[element], director_, w, result);
  if (!pressure_.empty()) {
    const auto [x1, x2, x3] = elements_->membrane().triangles[element];
    const Eigen::Vector3d x[3] = {positions_.col(x1), positions_.col(x2), positions_.col(x3)};
    add_pressure_stiffness_action(pressure_[element], x, w, result);
  }
}

void GradientStiffness::add_product(double factor, const double* w, double* result) const {
  static const PetscLogEvent event = log_event("PrismProduct");
  constexpr double sums = 2 * 9;
  const LogScope scope(event,
                       (product_flops(director_, !pressure_.empty()) + sums) * static_cast<double>(linearised_.size()));
  for (std::size_t e = 0; e < linearised_.size(); ++e) {
    const std::array<PetscInt, 3>& triangle = elements_->membrane().triangles[e];
    Eigen::Vector3d corner[3], product[3];
    for (std::size_t a = 0; a < 3; ++a) {
      corner[a] = Eigen::Map<const Eigen::Vector3d>(w + 3 * triangle[a]);
    }
    multiply(e, corner, product);
    for (std::size_t a = 0; a < 3; ++a) {
      Eigen::Map<Eigen::Vector3d>(result + 3 * triangle[a]) += factor * product[a];
    }
  }
}

void GradientStiffness::add_blocks(double factor, const HessianBlocks& blocks) const {
  static const PetscLogEvent event = log_event("PrismBlocks");
  constexpr double sums = 2 * 81;
  const double columns = 9 * product_flops(director_, !pressure_.empty());
  const LogScope scope(event, (columns + sums) * static_cast<double>(linearised_.size()));
  for (std::size_t e = 0; e < linearised_.size(); ++e) {
    for (std::size_t b = 0; b < 3; ++b) {
      Eigen::Matrix3d column[3];  // of the corners (0, b), (1, b), (2, b)
      for (int c = 0; c < 3; ++c) {
        Eigen::Vector3d w[3] = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
        Eigen::Vector3d product[3];
        w[b][c] = 1;
        multiply(e, w, product);
        for (std::size_t a = 0; a < 3; ++a) {
          column[a].col(c) = product[a];
        }
      }
      for (std::size_t a = 0; a < 3; ++a) {
        blocks.add(9 * e + 3 * a + b, factor * column[a]);
      }
    }
  }
}

}  // namespace pellicle::prism
