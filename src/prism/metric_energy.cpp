#include "prism/metric_energy.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

namespace pellicle::prism {

namespace {

/// A number above 0 at which a derivative vanishes at a minimum: Newton's method in its logarithm, kept inside the
/// bracket found so far. NaN without convergence.
/// @param upper bound of the number @param derivatives gives the first and the second derivative at a number
template <class Function>
double minimum(double start, double upper, const Function& derivatives) {
  constexpr double longest_step = 1;  // of the logarithm
  double lower = 0;
  double at = start;
  for (int iteration = 0; iteration < 100; ++iteration) {
    const auto [first, second] = derivatives(at);
    const double slope = first * at;  // by the logarithm
    const double curvature = second * at * at + slope;
    (slope > 0 ? upper : lower) = at;
    double step = curvature > 0 ? -slope / curvature : (slope > 0 ? -longest_step : longest_step);
    const bool converged = std::abs(step) < 1e-8;  // quadratic: what is left after it is rounding
    step = std::min(std::max(step, -longest_step), longest_step);
    const double next = at * std::exp(step);
    if (converged) {
      return next;
    }
    at = next > lower && next < upper ? next : std::sqrt(std::max(lower, 1e-12 * upper) * upper);
  }
  return std::numeric_limits<double>::quiet_NaN();
}

/// psi and its derivatives by (t, d) alone, c eliminated by the rule.
struct InPlaneDensity {
  double value, t, d, tt, td, dd, c;
};

/// Not finite if no c gives zero stress across the wall.
/// @param given c of ThicknessRule::fixed, or the starting value for plane_stress
InPlaneDensity in_plane_density(const Material& material, ThicknessRule rule, double t, double d, double given) {
  double c = given;
  if (rule == ThicknessRule::incompressible) {
    c = 1 / d;
  } else if (rule == ThicknessRule::plane_stress) {
    c = minimum(given > 0 ? given : 1, std::numeric_limits<double>::infinity(), [&](double at) {
      const EnergyDensity psi = energy_density(material, t, d, at);
      return std::pair(psi.gradient[2], psi.hessian[2][2]);
    });
  }
  const EnergyDensity psi = energy_density(material, t, d, c);
  const auto& [t1, d1, c1] = psi.gradient;
  InPlaneDensity result{psi.value, t1, d1, psi.hessian[0][0], psi.hessian[0][1], psi.hessian[1][1], c};
  const double tc = psi.hessian[0][2], dc = psi.hessian[1][2], cc = psi.hessian[2][2];
  if (rule == ThicknessRule::incompressible) {
    const double slope = -1 / (d * d);  // of c = 1/d
    result.d += c1 * slope;
    result.td += tc * slope;
    result.dd += 2 * dc * slope + cc * slope * slope + c1 * 2 / (d * d * d);
  } else if (rule == ThicknessRule::plane_stress) {
    result.tt -= tc * tc / cc;
    result.td -= tc * dc / cc;
    result.dd -= dc * dc / cc;
  }
  return result;
}

/// f(x, y) = psi(x + y, x y) of the squared principal stretches x >= y, with its derivatives.
struct PrincipalDensity {
  double x, y, xx, xy, yy;
};

PrincipalDensity principal_density(const InPlaneDensity& psi, double x, double y) {
  return {psi.t + psi.d * y, psi.t + psi.d * x, psi.tt + 2 * psi.td * y + psi.dd * y * y,
          psi.tt + psi.td * (x + y) + psi.dd * x * y + psi.d, psi.tt + 2 * psi.td * x + psi.dd * x * x};
}

/// The relaxed energy of a wrinkled or slack wall; none if the wall is taut.
/// @param psi at a, not relaxed @param given as for in_plane_density
std::optional<MetricEnergy> relaxed(const Material& material, ThicknessRule rule, const RestMetric& rest,
                                    const Eigen::Vector3d& a, const InPlaneDensity& psi, double given) {
  constexpr double rounding = 1e-10;  // of a strain: at rest the wall is taut
  const Eigen::Matrix3d map = cauchy_green_of_metric(rest);
  const Eigen::Vector3d green = map * a;  // C11, C22, sqrt(2) C12
  const double half = (green[0] - green[1]) / 2, shear = green[2] / std::sqrt(2.0);
  const double radius = std::hypot(half, shear);
  const double x = (green[0] + green[1]) / 2 + radius;
  const PrincipalDensity here = principal_density(psi, x, x - 2 * radius);
  if (here.y >= -rounding * std::abs(here.yy) || (x > 1 && radius < rounding)) {
    return std::nullopt;
  }
  if (x <= 1) {
    return MetricEnergy{0, Eigen::Vector3d::Zero(), Eigen::Matrix3d::Zero()};
  }
  const double y = minimum(1 / std::sqrt(x), x, [&](double width) {  // f_y vanishes there.
    const PrincipalDensity f =
        principal_density(in_plane_density(material, rule, x + width, x * width, given), x, width);
    return std::pair(f.y, f.yy);
  });
  const InPlaneDensity natural = in_plane_density(material, rule, x + y, x * y, given);
  const PrincipalDensity f = principal_density(natural, x, y);
  // By the energy w(x) of uniaxial tension along the unit vector n, with m across: dx = n.dC n, and the second
  // derivative of x along dC is 2 (n.dC m)^2 over the difference of the eigenvalues.
  const double slope = f.x;
  const double curvature = f.xx - f.xy * f.xy / f.yy;
  const double cos2 = half / radius, sin2 = shear / radius;  // of twice the angle of n
  const double root = std::sqrt(2.0);
  const Eigen::Vector3d along = map.transpose() * Eigen::Vector3d((1 + cos2) / 2, (1 - cos2) / 2, sin2 / root);
  const Eigen::Vector3d across = map.transpose() * Eigen::Vector3d(-sin2 / 2, sin2 / 2, cos2 / root);
  return MetricEnergy{
      rest.volume * natural.value, rest.volume * slope * along,
      rest.volume * (curvature * along * along.transpose() + slope / radius * across * across.transpose()),
      std::sqrt(natural.c)};
}

MetricEnergy collapsed() {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  return {std::numeric_limits<double>::infinity(), Eigen::Vector3d::Constant(nan), Eigen::Matrix3d::Constant(nan), nan};
}

/// Eigenvalues of a 2x2 matrix with real eigenvalues, the larger first.
Eigen::Vector2d eigenvalues(const Eigen::Matrix2d& matrix) {
  const double mean = matrix.trace() / 2;
  // Not from the determinant: for nearly equal eigenvalues only rounding would be left.
  const double half = (matrix(0, 0) - matrix(1, 1)) / 2;
  const double radius = std::sqrt(std::max(0.0, half * half + matrix(0, 1) * matrix(1, 0)));
  return {mean + radius, mean - radius};
}

bool is_positive(const Eigen::Matrix3d& m) {
  return m(0, 0) > 0 && m(0, 0) * m(1, 1) > m(0, 1) * m(0, 1) && m.determinant() >= 0;
}

}  // namespace

RestMetric rest_metric(const Eigen::Vector3d& e12, const Eigen::Vector3d& e13, double thickness) {
  const double twice_area = e12.cross(e13).norm();
  const double area = twice_area / 2;
  return {Eigen::Vector3d(e13.dot(e13), -e12.dot(e13), e12.dot(e12)) / (twice_area * twice_area), area,
          area * thickness};
}

Eigen::Matrix2d inverse_edges(const RestMetric& rest) {
  // rest.inverse = R R^T
  const double r22 = std::sqrt(rest.inverse[2]);
  Eigen::Matrix2d r;
  r << 1 / (2 * rest.area * r22), rest.inverse[1] / r22, 0, r22;
  return r;
}

Eigen::Matrix3d cauchy_green_of_metric(const RestMetric& rest) {
  // C = R^T A R
  const Eigen::Matrix2d r = inverse_edges(rest);
  const double r11 = r(0, 0), r12 = r(0, 1), r22 = r(1, 1);
  const double root = std::sqrt(2.0);
  Eigen::Matrix3d map;
  map << r11 * r11, 0, 0,                   //
      r12 * r12, 2 * r12 * r22, r22 * r22,  //
      root * r11 * r12, root * r11 * r22, 0;
  return map;
}

MetricEnergy metric_energy(const Material& material, ThicknessRule rule, const RestMetric& rest,
                           const Eigen::Vector3d& a, double given_ratio, Derivatives order) {
  // t = inverse : a and d = det a / det of the undeformed metric, with their derivatives by a
  const double scale = 1 / (4 * rest.area * rest.area);
  const Eigen::Vector3d by_t(rest.inverse[0], 2 * rest.inverse[1], rest.inverse[2]);
  const Eigen::Vector3d by_d = scale * Eigen::Vector3d(a[2], -2 * a[1], a[0]);
  const double t = by_t.dot(a);
  const double determinant = a[0] * a[2] - a[1] * a[1];
  // Edges along one line leave rounding, which depends on whether the processor fuses products and sums.
  if (!(determinant > 4 * std::numeric_limits<double>::epsilon() * a[0] * a[2])) {
    return collapsed();
  }
  const double d = scale * determinant;
  const double given = given_ratio * given_ratio;
  const InPlaneDensity psi = in_plane_density(material, rule, t, d, given);
  if (!std::isfinite(psi.value)) {
    return collapsed();
  }

  MetricEnergy result;
  if (const auto wrinkled = material.wrinkles ? relaxed(material, rule, rest, a, psi, given) : std::nullopt) {
    result = std::isfinite(wrinkled->energy) ? *wrinkled : collapsed();
  } else {
    result.energy = rest.volume * psi.value;
    result.gradient = rest.volume * (psi.t * by_t + psi.d * by_d);
    result.thickness_ratio = std::sqrt(psi.c);
    if (order == Derivatives::second) {
      const Eigen::Vector3d by_t_row = psi.tt * by_t + psi.td * by_d;
      const Eigen::Vector3d by_d_row = psi.td * by_t + psi.dd * by_d;
      result.hessian = by_t * by_t_row.transpose() + by_d * by_d_row.transpose();
      result.hessian(0, 2) += psi.d * scale;
      result.hessian(2, 0) += psi.d * scale;
      result.hessian(1, 1) -= 2 * psi.d * scale;
      result.hessian *= rest.volume;
    }
  }
  if (material.tension > 0) {
    result.energy += rest.volume * material.tension / 2 * (t - 2);
    result.gradient += rest.volume * material.tension / 2 * by_t;
  }
  return result;
}

int metric_energy_flops(const Material& material, ThicknessRule rule, Derivatives order) {
  constexpr int arguments = 20;  // t, d, c and the derivatives of t and d
  const int elimination = rule == ThicknessRule::incompressible ? 18 : rule == ThicknessRule::plane_stress ? 9 : 0;
  const int derivatives = order == Derivatives::first ? 14 : 73;  // energy, gradient and Hessian by the metric
  return arguments + energy_density_flops(material) + elimination + derivatives;
}

MetricEnergy positive_part(const MetricEnergy& energy, const RestMetric& rest) {
  MetricEnergy result = energy;

  // The gradient as a symmetric matrix G is V/2 D^-1 S D^-T, D the undeformed edges: positive where S is, in any axes.
  const Eigen::Vector3d& g = energy.gradient;
  const double determinant = 4 * rest.area * rest.area * (g[0] * g[2] - g[1] * g[1] / 4);
  if (g[0] < 0 || g[2] < 0 || determinant < 0) {
    // Principal values of V/2 S.
    const double mean =
        2 * rest.area * rest.area * (g[0] * rest.inverse[2] - g[1] * rest.inverse[1] + g[2] * rest.inverse[0]);
    const double radius = std::sqrt(std::max(mean * mean - determinant, 0.0));
    const double larger = mean > 0 ? mean + radius : determinant / (mean - radius);
    const double smaller = mean > 0 ? determinant / larger : mean - radius;
    if (larger <= 0) {
      result.gradient.setZero();
    } else if (smaller < 0) {
      const Eigen::Vector3d identity(rest.inverse[0], 2 * rest.inverse[1], rest.inverse[2]);  // S = 1
      result.gradient = larger / (larger - smaller) * (g - smaller * identity);
    }
  }

  if (!is_positive(energy.hessian)) {
    const Eigen::Matrix3d map = cauchy_green_of_metric(rest);
    const Eigen::Matrix3d inverse = map.inverse();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> stiffness(inverse.transpose() * energy.hessian * inverse);
    const Eigen::Matrix3d axes = map.transpose() * stiffness.eigenvectors();
    result.hessian = axes * stiffness.eigenvalues().cwiseMax(0).asDiagonal() * axes.transpose();
  }
  return result;
}

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

}  // namespace pellicle::prism
