#pragma once

#include <algorithm>
#include <cmath>

namespace pellicle {
inline namespace contact {

/// Potential that keeps two surfaces apart, by their gap g [m]: a spring of stiffness k below the gap d, the thickness;
/// its outermost part, of length w, is cubic, so that the force sets in smoothly. With s = d - g
///
///     psi = k s^3/(6 w) where 0 < s < w,   k (s^2 - s w + w^2/3)/2 where s > w
///
/// The force is k s^2/(2 w) up to s = w and k (s - w/2) beyond, the curvature k s/w and k. Bodies need it at g < 0,
/// too. Where surfaces cannot pass through each other, because displacements are bounded, the load may exceed the force
/// of any spring at g = 0: there a barrier without bound is added where g < e (Li et al., Incremental potential
/// contact, ACM Trans. Graph. 39, 2020, eq. 6),
///
///     psi_e = -k (g - e)^2 ln(g/e)
struct Barrier {
  double stiffness = 0;  ///< k [N/m]
  double thickness = 0;  ///< d [m]
  double onset = 1;      ///< w/d; 1: the whole spring is cubic
  double steep = 0;      ///< e/d; 0: no barrier without bound is added

  double value(double gap) const {
    const double s = depth(gap);
    const double w = onset * thickness;
    const double spring = s < w ? s * s * s / (6 * w) : (s * s - s * w + w * w / 3) / 2;
    return stiffness * (spring - (is_steep(gap) ? std::pow(gap - end(), 2) * std::log(gap / end()) : 0));
  }
  /// Derivative by the gap, minus the force; at most 0 [N].
  double slope(double gap) const {
    const double s = depth(gap);
    const double w = onset * thickness;
    const double spring = s < w ? s * s / (2 * w) : s - w / 2;
    const double inside = gap - end();
    return -stiffness * (spring + (is_steep(gap) ? inside * (2 * std::log(gap / end()) + inside / gap) : 0));
  }
  /// Second derivative by the gap, at least 0 [N/m].
  double curvature(double gap) const {
    const double spring = std::min(depth(gap) / (onset * thickness), 1.0);
    const double inside = (gap - end()) / gap;
    return stiffness * (spring + (is_steep(gap) ? inside * inside - 4 * inside - 2 * std::log(gap / end()) : 0));
  }

 private:
  double end() const { return steep * thickness; }
  bool is_steep(double gap) const { return steep > 0 && gap < end(); }
  double depth(double gap) const { return std::max(thickness - gap, 0.0); }
};

}  // namespace contact
}  // namespace pellicle
