#pragma once

#include <algorithm>

namespace pellicle {
inline namespace contact {

/// What keeps two surfaces apart, by their gap g [m]: a spring of stiffness k from the thickness d on, of which the
/// outermost part, an `onset` of w, is cubic, so that the force sets in smoothly. Where s = d - g
///
///     psi = k s^3/(6 w) where 0 < s < w,   k (s^2 - s w + w^2/3)/2 where s > w
///
/// Its force is k s^2/(2 w), and beyond the onset k (s - w/2); its curvature k s/w and k. It continues beyond g = 0,
/// since a bound on displacements, not the force, keeps surfaces from passing through each other.
struct Barrier {
  double stiffness = 0;  ///< k [N/m]
  double thickness = 0;  ///< d [m]
  double onset = 1;      ///< w/d; 1: all of it is cubic

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
