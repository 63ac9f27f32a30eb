#include "air/wind.h"

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>

#include "base/error.h"
#include "base/noise.h"
#include "geometry/key_points.h"
#include "geometry/pi.h"

namespace pellicle::air {

Wind::Wind(const WindOptions& options) : options_(options) {
  if (const std::string fault = fault_of_key_points(options.velocity); !fault.empty()) {
    throw Error("force.wind.velocity: " + fault);
  }
  if (options.turbulence > 0) {
    // Numbers that follow from the seed: uniform in [0, 1), and normally distributed (Box and Muller).
    std::uint64_t next = 0;
    const auto uniform = [&] { return (1 + noise(options.seed, next++)) / 2; };
    const auto normal = [&] {
      const double radius = std::sqrt(-2 * std::log(1 - uniform()));
      return radius * std::cos(2 * pi * uniform());
    };
    const auto vector = [&] {
      const double x = normal();
      const double y = normal();
      return Eigen::Vector3d(x, y, normal());
    };
    constexpr int mode_count = 32;
    double mean_square = 0;  // of the whole vector
    for (int n = 0; n < mode_count; ++n) {
      Mode mode;
      mode.wave_number = std::sqrt(pi / 2) / options.length * vector();
      mode.amplitude = vector().normalized().cross(mode.wave_number);
      mode.phase = 2 * pi * uniform();
      mean_square += mode.amplitude.squaredNorm() / 2;
      modes_.push_back(mode);
    }
    for (Mode& mode : modes_) {
      mode.amplitude *= std::sqrt(3 / mean_square);
    }
  }
  set_time(0);
}

void Wind::set_time(double time) {
  if (!options_.velocity.empty()) {
    mean_ = place_on_key_points(options_.velocity, time);
    carried_ = modes_.empty() ? Eigen::Vector3d::Zero() : integral_on_key_points(options_.velocity, time);
    rms_ = options_.turbulence * mean_.norm();
  }
}

Eigen::Vector3d Wind::at(const Eigen::Vector3d& x) const {
  Eigen::Vector3d velocity = mean_;
  if (rms_ > 0) {
    const Eigen::Vector3d place = x - carried_;
    for (const Mode& mode : modes_) {
      velocity += rms_ * std::cos(mode.wave_number.dot(place) + mode.phase) * mode.amplitude;
    }
  }
  return velocity;
}

}  // namespace pellicle::air
