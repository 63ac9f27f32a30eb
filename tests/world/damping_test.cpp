// What damps velocities changes nothing that is at rest: weights, stretches and forces on bodies.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/alone.h"
#include "tests/support/grid_mesh.h"
#include "tests/support/print_once.h"

namespace pellicle::damping_test {
namespace {

constexpr double edge = 0.05;

struct DampedSheet : Alone {
  explicit DampedSheet(const Options& options) : Alone(grid_mesh(6, 2, edge), options) {}

  void go(double until) {
    while (state().time < until - 1e-9) {
      const AloneStep step = advance(object.options().time.step);
      ASSERT_TRUE(step.converged) << step.reason;
    }
  }
  /// The greatest distance along an axis from where the sheet is undeformed [m].
  double moved(int axis) const {
    double most = (state().position.values() - surface().rest).row(axis).cwiseAbs().maxCoeff();
    MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPI_DOUBLE, MPI_MAX, surface().comm());
    return most;
  }
  double weight() const { return figure("mass_left") * object.options().force.gravity.norm(); }
};

Options damped(const std::string& dynamics, double rate_times_step) {
  Options options;
  options.dynamics = dynamics;
  options.time.step = 0.02;
  options.force.damping = rate_times_step / options.time.step;
  options.sheet.areal_density = 1;
  options.material.damping = 0.1;
  options.elastic.newton_tolerance = 1e-8;
  options.spring.damping = 0.1;
  options.spring.newton_tolerance = 1e-8;
  options.heat.diffusivity = 0;
  return options;
}

/// How far a strip stretches that hangs by its upper edge [m].
double stretch(const std::string& dynamics, double rate_times_step) {
  Options options = damped(dynamics, rate_times_step);
  options.force.gravity = {9.81, 0, 0};
  options.pins["top"].box = {-1e-3, -1, -1, 1e-3, 1, 1};
  DampedSheet strip(options);
  strip.go(4);
  return strip.moved(0);
}

TEST(Damping, AHangingStripStretchesByItsWholeWeight) {
  for (const char* dynamics : {"elastic", "spring"}) {
    const double undamped = stretch(dynamics, 0);
    print_once("  %s: stretches by %.6f m\n", dynamics, undamped);
    for (const double rate_times_step : {0.1, 0.5, 1.0}) {
      EXPECT_NEAR(stretch(dynamics, rate_times_step), undamped, 1e-3 * undamped) << dynamics << rate_times_step;
    }
  }
  const double formula = 9.81 * std::pow(6 * edge, 2) / (2 * 1000.0);
  EXPECT_NEAR(stretch("elastic", 1), formula, 0.02 * formula) << "w L^2/(2 K)";
}

/// A plate on a plane, in a wind from above.
/// @returns the force on the plane over weight and push of the wind, normal part
double press(const std::string& dynamics, double rate_times_step, double wind) {
  constexpr double density = 1.2;
  Options options = damped(dynamics, rate_times_step);
  options.sheet.areal_density = 0.1;
  BodyOptions& plane = options.bodies["table"];
  plane.shape = "plane";
  plane.point = {0, 0, -1e-3};
  if (wind > 0) {
    options.force.air.density = density;
    options.force.air.wind.velocity = {{0, 0, 0, -wind}};
  }
  DampedSheet plate(options);
  plate.go(2);
  const double force = -plate.object.last_step().loads.at(0).force.z();
  const double push = density / 2 * wind * wind * 12 * edge * edge;
  return force / (plate.weight() + (wind > 0 ? push : 0));
}

TEST(Damping, APlatePressesWithItsWholeWeight) {
  for (const char* dynamics : {"elastic", "spring", "projection"}) {
    for (const double rate_times_step : {0.0, 0.1, 0.5, 1.0}) {
      EXPECT_NEAR(press(dynamics, rate_times_step, 0), 1, 1e-3) << dynamics << " " << rate_times_step;
    }
  }
}

TEST(Damping, AnElasticPlateInTheWindPressesWithItsWholeWeightAndTheWinds) {
  for (const double wind : {3.0, 10.0}) {  // h D/m = 0.36 and 1.2
    EXPECT_NEAR(press("elastic", 0.2, wind), 1, 1e-3) << wind;
  }
}

TEST(Damping, AFreeSheetFadesAndFallsAsTheFormulaSays) {
  // dv/dt = g - c v: each step is exact, whatever its length.
  for (const char* dynamics : {"elastic", "spring", "projection"}) {
    DampedSheet sheet(damped(dynamics, 0.5));
    const double c = *sheet.object.options().force.damping;
    sheet.go(0.2);
    const double speed = 9.81 / c * (1 - std::exp(-c * sheet.state().time));
    for (PetscInt i = 0; i < sheet.surface().particles.owned; ++i) {
      EXPECT_NEAR(sheet.state().velocity.vector(i).z(), -speed, 1e-6 * speed) << dynamics;
    }
  }
}

}  // namespace
}  // namespace pellicle::damping_test
