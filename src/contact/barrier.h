#pragma once

#include <algorithm>

namespace pellicle {
inline namespace contact {

/// What keeps two surfaces apart, by their gap g [m]: the cubic
///
///     psi(g) = -2 k / (3 d) (g - d)^3   where g < d, else 0
///
/// of thickness d [m]. Its force is 2 k d at g = 0, its curvature 0 at d and 4 k at 0; both go on beyond g = 0, as what
/// keeps surfaces from passing through each other is a bound on displacements and not the force.
struct Barrier {
  double stiffness = 0;  ///< k [N/m]
  double thickness = 0;  ///< d [m]

  double value(double gap) const {
    return gap < thickness ? 2 * stiffness / (3 * thickness) * depth(gap) * square(gap) : 0;
  }
  /// Minus the force, not positive [N].
  double slope(double gap) const { return gap < thickness ? -2 * stiffness * square(gap) / thickness : 0; }
  /// Not negative [N/m].
  double curvature(double gap) const { return gap < thickness ? 4 * stiffness * depth(gap) / thickness : 0; }

 private:
  double depth(double gap) const { return thickness - gap; }
  double square(double gap) const { return depth(gap) * depth(gap); }
};

/// The same of which only the outermost part, an `onset` of w = 0.05 d, is cubic. Where g < d - w it is a spring of
/// stiffness k, whose force is k (d - w/2 - g): Newton's method finds its place at once, where from deep in a cubic
/// each iteration halves the way.
struct LinearBarrier {
  static constexpr double onset = 0.05;  ///< w/d

  double stiffness = 0;  ///< k [N/m]
  double thickness = 0;  ///< d [m]

  double value(double gap) const {
    const double s = depth(gap);
    const double w = onset * thickness;
    return stiffness * (s < w ? s * s * s / (6 * w) : (s * s - s * w + w * w / 3) / 2);
  }
  /// Minus the force, not positive [N].
  double slope(double gap) const {
    const double s = depth(gap);
    const double w = onset * thickness;
    return -stiffness * (s < w ? s * s / (2 * w) : s - w / 2);
  }
  /// Not negative [N/m].
  double curvature(double gap) const { return stiffness * std::min(depth(gap) / (onset * thickness), 1.0); }

 private:
  double depth(double gap) const { return std::max(thickness - gap, 0.0); }
};

}  // namespace contact
}  // namespace pellicle
