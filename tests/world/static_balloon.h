#pragma once

#include <gtest/gtest.h>

#include "tests/support/alone.h"
#include "world/wall_motion.h"

namespace pellicle {

/// Options of a balloon at rest at every step: no mass, no weight, and a damping that only steadies rigid motions where
/// a step is a second long.
inline Options static_options() {
  Options options;
  options.force.gravity.setZero();
  options.prism.inertia = false;
  options.prism.mass_damping = 1e-3;
  return options;
}

/// The same of a plate: St. Venant-Kirchhoff in plane stress. @param young [Pa] @param thickness [m]
inline Options static_plate_options(double young, double poisson, double thickness) {
  Options options = static_options();
  options.wall.thickness = thickness;
  options.wall.thickness_rule = "plane_stress";
  options.wall.material.law = "st_venant_kirchhoff";
  options.wall.material.young_modulus = young;
  options.wall.material.poisson_ratio = poisson;
  return options;
}

/// A balloon that steps by itself.
struct StaticBalloon : Alone {
  StaticBalloon(const SurfaceMesh& mesh, const Options& options) : Alone(mesh, options, ChainKind::inflate) {}

  /// One step to a time [s].
  AloneStep step_to(double time) {
    AloneStep result = advance(time - state().time);
    newton_iterations += result.newton_iterations;
    linear_iterations += result.motion_iterations;
    return result;
  }

  /// One step that must converge.
  void reach(double time) {
    const AloneStep result = step_to(time);
    ASSERT_TRUE(result.converged) << "at " << time << " s: " << result.reason;
  }

  /// Steps of length h [s] to a time, or beyond it by less than a step [s].
  void go_to(double time, double h) {
    while (state().time < time) {
      reach(state().time + h);
    }
  }
  /// So many equal steps from time 0 to a time [s].
  void reach(double time, int steps) {
    for (int step = 1; step <= steps; ++step) {
      reach(time * step / steps);
    }
  }

  double pressure() const { return state().pressure[0]; }
  double volume() const { return chambers().volumes(state().position)[0]; }
  /// The elements of its wall.
  const PrismElements& elements() { return static_cast<const WallMotion&>(object.motion()).elements(); }

  int newton_iterations = 0;
  int linear_iterations = 0;
};

}  // namespace pellicle
