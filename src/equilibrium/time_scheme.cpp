#include "equilibrium/time_scheme.h"

#include <cmath>

namespace pellicle::equilibrium {

TimeIntegrator TimeIntegrator::generalized_alpha(double spectral_radius) {
  TimeIntegrator result;
  result.is_second_order_ = true;
  result.alpha_m_ = (2 * spectral_radius - 1) / (spectral_radius + 1);
  result.alpha_f_ = spectral_radius / (spectral_radius + 1);
  result.gamma_ = 0.5 - result.alpha_m_ + result.alpha_f_;
  result.beta_ = std::pow(1 - result.alpha_m_ + result.alpha_f_, 2) / 4;
  return result;
}

TimeIntegrator TimeIntegrator::statics(std::optional<double> arc_length) {
  TimeIntegrator result;
  result.is_static_ = true;
  result.arc_length_ = arc_length;
  return result;
}

Eigen::Vector3d TimeIntegrator::y_v(double h, const Kinematics& start) const {
  if (!is_second_order_) {
    return Eigen::Vector3d::Zero();
  }
  return ((fraction() * gamma_ / beta_ - 1) * start.velocity -
          fraction() * h * (1 - gamma_ / (2 * beta_)) * start.acceleration) /
         rate(h);
}

Kinematics TimeIntegrator::end(double h, const Eigen::Vector3d& displacement, const Kinematics& start) const {
  if (!is_second_order_) {
    return {displacement / h, Eigen::Vector3d::Zero()};
  }
  const Eigen::Vector3d acceleration =
      ((displacement - h * start.velocity) / (h * h) - (0.5 - beta_) * start.acceleration) / beta_;
  return {start.velocity + h * ((1 - gamma_) * start.acceleration + gamma_ * acceleration), acceleration};
}

double TimeIntegrator::error(double h, const Kinematics& start, const Kinematics& end) const {
  return is_second_order_ ? std::abs(1.0 / 6 - beta_) * h * h * (end.acceleration - start.acceleration).norm()
                          : h / 2 * (end.velocity - start.velocity).norm();
}

}  // namespace pellicle::equilibrium
