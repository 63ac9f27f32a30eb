#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "base/namespaces.h"

namespace pellicle::equilibrium {

/// Time integration by TimeIntegrator.
enum class TimeScheme { implicit_euler, generalized_alpha, statics };
inline std::vector<std::string> names_of(TimeScheme) { return {"implicit_euler", "generalized_alpha", "statics"}; }

/// Velocity and acceleration of a vertex at the end of a step.
struct Kinematics {
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();      ///< [m/s]
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();  ///< [m/s^2]; of implicit Euler always 0
};

/// A step of length h from x^n, v^n, a^n to x^{n+1}, by implicit Euler or by generalized alpha (Chung and Hulbert, A
/// time integration algorithm for structural dynamics with improved numerical dissipation, J. Appl. Mech. 60, 1993).
/// The forces are in balance at y = x^n + s (x^{n+1} - x^n), at the time t^n + s h: there
///
///     M a(y) + C v(y) + dU/dy(y) = 0,  a(y) = k (y - y_a),  v(y) = c (y - y_v),
///
/// and y is the unknown of the step, so that inertia and damping are potentials of it, m k |y - y_a|^2 / 2 and
/// c (y - y_v).C (y - y_v) / 2. For implicit Euler s = 1, k = 1/h^2, c = 1/h, y_a = x^n + h v^n, y_v = x^n.
///
/// For generalized alpha y is their x_{n+1-alpha_f}, and a(y) their a_{n+1-alpha_m}, with
/// x^{n+1} = x^n + h v^n + h^2 ((1/2 - beta) a^n + beta a^{n+1}) and v^{n+1} = v^n + h ((1 - gamma) a^n + gamma
/// a^{n+1}). The spectral radius of the fastest motions gives all four (their eq. 25); the error in positions is of
/// order h^2. With 1 it is the midpoint rule, which keeps angular momentum too.
///
/// Statics has neither inertia nor damping, k = c = 0: x^{n+1} is an equilibrium with the loads at its time. Otherwise
/// it is like implicit Euler. By arc length the time of the loads is an unknown, and a step goes along the path of
/// equilibria by the arc length in a second, times h.
class TimeIntegrator {
 public:
  /// Implicit Euler.
  TimeIntegrator() = default;
  /// @param spectral_radius 0 to 1: factor by which a step multiplies motions much faster than itself; 1: no
  /// dissipation
  static TimeIntegrator generalized_alpha(double spectral_radius);

  /// @param arc_length root-mean-square displacement of the free vertices in a second [m/s]; none: the loads have the
  /// time of the step
  static TimeIntegrator statics(std::optional<double> arc_length);

  bool is_static() const { return is_static_; }
  const std::optional<double>& arc_length() const { return arc_length_; }
  /// Whether the method continues with accelerations and its error is of order h^2; otherwise h.
  bool is_second_order() const { return is_second_order_; }
  /// Time by which the loads go on in a step [s]: by arc length 0, as their time follows.
  double load_step(double h) const { return arc_length_ ? 0 : h; }
  /// s
  double fraction() const { return 1 - alpha_f_; }
  /// k [1/s^2]
  double inertia(double h) const { return is_static_ ? 0 : (1 - alpha_m_) / (beta_ * h * h * fraction()); }
  /// c [1/s]
  double rate(double h) const { return is_static_ ? 0 : gamma_ / (beta_ * h); }
  /// y_a - x^n [m]. @param start v^n and a^n
  Eigen::Vector3d y_a(double h, const Kinematics& start) const {
    return fraction() * h * (start.velocity + h * (0.5 - beta_ / (1 - alpha_m_)) * start.acceleration);
  }
  /// y_v - x^n [m]
  Eigen::Vector3d y_v(double h, const Kinematics& start) const;
  /// y - x^n without forces, where Newton's method starts [m].
  Eigen::Vector3d predicted(double h, const Kinematics& start) const { return fraction() * h * start.velocity; }
  /// v^{n+1} and a^{n+1}. @param displacement x^{n+1} - x^n [m]
  Kinematics end(double h, const Eigen::Vector3d& displacement, const Kinematics& start) const;
  /// Estimated error of the step in x^{n+1} [m]: of implicit Euler |x^{n+1} - x^n - h v^n| / 2, which goes with h^2; of
  /// generalized alpha |1/6 - beta| h^2 |a^{n+1} - a^n|, which goes with h^3 (Zienkiewicz and Xie, A simple error
  /// estimator and adaptive time stepping procedure for dynamic analysis, Earthquake Eng. Struct. Dyn. 20, 1991).
  double error(double h, const Kinematics& start, const Kinematics& end) const;

 private:
  bool is_static_ = false;
  std::optional<double> arc_length_;
  // Values of implicit Euler: gamma/beta = 1, and y_a without a^n, which is 0.
  bool is_second_order_ = false;
  double alpha_m_ = 0;
  double alpha_f_ = 0;
  double beta_ = 1;
  double gamma_ = 1;
};

}  // namespace pellicle::equilibrium
