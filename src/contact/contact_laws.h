#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "base/namespaces.h"

namespace pellicle::contact {

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

/// The part of a vector along a surface of this normal.
inline Eigen::Vector3d along_surface(const Eigen::Vector3d& vector, const Eigen::Vector3d& normal) {
  return vector - normal * normal.dot(vector);
}

/// Smooth Coulomb friction of incremental potential contact (Li et al. 2020, section 5): its potential is mu N s(y) of
/// the slip y, with s(y) = y, but y^2/e - y^3/(3 e^2) + e/3 up to y = e.
struct SmoothSlip {
  double e = 0;  ///< slip from which on friction is full [m]

  double value(double y) const { return y < e ? y * y / e - y * y * y / (3 * e * e) + e / 3 : y; }
  /// s'(y) / y.
  double slope_over(double y) const { return y < e ? 2 / e - y / (e * e) : 1 / y; }
  /// r'(y) of r(y) = y/s'(y).
  double regular_slope(double y) const { return y < e ? e * e / ((2 * e - y) * (2 * e - y)) : 1; }
};

/// The Hessian of s(|u|), for Newton's method, which would jump back and forth across the bend of s. The direction of
/// friction, w = u/r(|u|), is an unknown of its own, of at most unit length, that is eliminated (Chan, Golub and Mulet
/// 1999, for total variation). That leaves (1 - r' (w u^T + u w^T)/(2 |u|))/r, which is not negative: at first, with
/// w = 0, the Hessian of a parabola above s, and in the end the exact one.
class SlipTangent {
 public:
  /// Moves to the slip of the present Newton iterate; w follows by a Newton step of its own.
  void move_to(const SmoothSlip& s, const Eigen::Vector3d& slip) {
    if (const double y = slip_.norm(); y > 0) {
      const double longer = slip_.dot(slip - slip_) / y;
      const Eigen::Vector3d w = s.slope_over(y) * (slip - s.regular_slope(y) * longer * direction_);
      direction_ = w / std::max(w.norm(), 1.0);
    }
    slip_ = slip;
  }

  /// The Hessian along a surface of this normal (3 x 3) [1/m].
  Eigen::Matrix3d hessian(const SmoothSlip& s, const Eigen::Vector3d& normal) const {
    const double y = slip_.norm();
    Eigen::Matrix3d sum = Eigen::Matrix3d::Identity() - normal * normal.transpose();
    if (y > 0) {
      const Eigen::Matrix3d turned = s.regular_slope(y) / (2 * y) * direction_ * slip_.transpose();
      sum -= turned + turned.transpose();
    }
    return s.slope_over(y) * sum;
  }

 private:
  Eigen::Vector3d slip_ = Eigen::Vector3d::Zero();       ///< u [m]
  Eigen::Vector3d direction_ = Eigen::Vector3d::Zero();  ///< w
};

}  // namespace pellicle::contact
