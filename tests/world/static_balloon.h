#pragma once

#include <gtest/gtest.h>

#include <utility>

#include "surface/membrane.h"
#include "tests/support/alone.h"
#include "world/inflate.h"

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

/// A balloon with its chain and its state.
struct StaticBalloon {
  StaticBalloon(const SurfaceMesh& mesh, Options given)
      : options(std::move(given)),
        membrane(make_membrane(PETSC_COMM_WORLD, mesh, options.sheet)),
        clock(Inflate::stage_names()),
        chain(membrane, options, clock),
        state(chain.initial_state()) {}

  /// One step to a time [s].
  InflateStep step_to(double time) {
    InflateStep result = alone.advance(state, time - state.time);
    newton_iterations += result.newton_iterations;
    linear_iterations += result.linear_iterations;
    return result;
  }

  /// One step that must converge.
  void reach(double time) {
    const InflateStep result = step_to(time);
    ASSERT_TRUE(result.converged) << "at " << time << " s: " << result.reason;
  }

  double pressure() const { return state.pressure[0]; }
  double volume() const { return chain.chambers().volumes(state.position)[0]; }

  Options options;
  Membrane membrane;
  StageClock clock;
  Inflate chain;
  Alone<Inflate> alone{chain};
  BalloonState state;
  int newton_iterations = 0;
  int linear_iterations = 0;
};

}  // namespace pellicle
