#pragma once

namespace pellicle {
inline namespace elastic {

/// The energy that keeps a spring of length d below a strain limit e_max, in addition to its own elasticity:
///
///     U = K l^2 w^2 B(u),  B(u) = u^3 / (1 - u)^2,  u = (|d/l - 1| - e_0) / w,  w = e_max - e_0
///
/// with the length l without force and a stiffness K. It is 0 up to the strain e_0 = 0.8 e_max, twice continuously
/// differentiable, convex, and grows without bound towards the limit. Shortening is limited only if e_max < 1.
///
/// Beyond a fraction u of `exact_to`, B is continued by its Taylor polynomial of second order: Newton's method can then
/// start beyond the limit, and the result has to be checked against it.
struct StrainLimit {
  static constexpr double begins = 0.8;  ///< e_0 / e_max

  double largest = 1;     ///< e_max, more than 0
  double stiffness = 0;   ///< K [N/m]
  double exact_to = 0.5;  ///< less than 1

  /// U [J] and its derivatives by d.
  struct Law {
    double value = 0;
    double slope = 0;      ///< [N]
    double curvature = 0;  ///< [N/m]
  };

  /// u: 1 at the limit, zero or negative where nothing acts. @param length d [m] @param target l [m]
  double fraction(double length, double target) const;
  Law at(double length, double target) const;
};

}  // namespace elastic
}  // namespace pellicle
