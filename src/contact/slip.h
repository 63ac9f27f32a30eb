#pragma once

namespace pellicle {
inline namespace contact {

/// Smooth Coulomb friction of incremental potential contact (Li et al. 2020, section 5): its potential is mu N s(y) of
/// the slip y, with s(y) = y, but y^2/e - y^3/(3 e^2) + e/3 up to y = e.
struct SmoothSlip {
  double e = 0;  ///< slip from which on friction is full [m]

  double value(double y) const { return y < e ? y * y / e - y * y * y / (3 * e * e) + e / 3 : y; }
  /// s'(y) / y.
  double slope_over(double y) const { return y < e ? 2 / e - y / (e * e) : 1 / y; }
  /// s''(y), not negative.
  double curvature(double y) const { return y < e ? 2 / e - 2 * y / (e * e) : 0; }
};

}  // namespace contact
}  // namespace pellicle
