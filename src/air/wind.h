#pragma once

#include <Eigen/Core>
#include <vector>

#include "air/air_options.h"

namespace pellicle::air {

/// The velocity of the air by place and time: the mean U(t) of the key points, plus turbulence of N random Fourier
/// modes (Kraichnan, Phys. Fluids 13, 22 (1970)) that the mean carries along (Taylor's hypothesis), in proportion to
/// |U(t)|:
///
///     u(x, t) = U(t) + I |U(t)| sum_n a_n cos(k_n.(x - X(t)) + phi_n),  X(t) the integral of U from 0 to t.
///
/// The a_n are across the k_n, so that it is divergence-free; the components of the k_n are normal with variance pi/(2
/// L^2) and |a_n| grows with |k_n|, so that over many seeds the longitudinal correlation is exp(-pi r^2/(4 L^2)), with
/// integral length L. Each field is scaled to the given mean square over all places. The wind depends on options, place
/// and time alone.
class Wind {
 public:
  /// @throws Error that names force.wind.velocity if its rows are no key points
  explicit Wind(const WindOptions& options);

  /// Sets the time [s] of `at`.
  void set_time(double time);

  /// U(t) [m/s]
  const Eigen::Vector3d& mean() const { return mean_; }
  /// u(x, t) [m/s] @param x [m]
  Eigen::Vector3d at(const Eigen::Vector3d& x) const;

 private:
  struct Mode {
    Eigen::Vector3d amplitude;    ///< a_n, of a field of which each component has the rms 1
    Eigen::Vector3d wave_number;  ///< k_n [1/m]
    double phase = 0;             ///< phi_n
  };

  WindOptions options_;
  std::vector<Mode> modes_;  ///< none without turbulence
  Eigen::Vector3d mean_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d carried_ = Eigen::Vector3d::Zero();  ///< X(t) [m]
  double rms_ = 0;                                     ///< I |U(t)| [m/s]
};

}  // namespace pellicle::air
