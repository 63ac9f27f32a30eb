// The works of the history against kinetic and elastic energy: they close to the order of the steps.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "meshing/closed_shapes.h"
#include "tests/support/grid_mesh.h"
#include "tests/support/print_once.h"
#include "tests/world/static_balloon.h"

namespace pellicle::work_test {
namespace {

/// Kinetic and elastic. Collective. [J]
double energy_of(const Alone& alone) { return alone.figure("kinetic_energy") + alone.figure("elastic_energy"); }

/// What of the works has not become energy, as a fraction of all that was done.
struct Closure {
  double open = 0;
  Eigen::VectorXd works;
};

Closure close(double energy_before, double energy_after, const Eigen::VectorXd& works) {
  return {(works.sum() - (energy_after - energy_before)) / works.cwiseAbs().sum(), works};
}

/// Key points of a path that begins and ends gently. @param reach half way [m]
Rows there_and_back(const Eigen::Vector3d& reach, double end) {
  Rows path;
  constexpr int points = 100;
  for (int n = 0; n <= points; ++n) {
    const Eigen::Vector3d place = (1 - std::cos(2 * M_PI * n / points)) / 2 * reach;
    path.push_back({end * n / points, place.x(), place.y(), place.z()});
  }
  return path;
}

/// A sheet that is led by an edge in the wind, damped in every way. @param has_floor on which it slides
Closure led_sheet(const std::string& dynamics, bool has_floor, double h) {
  Options options;
  options.dynamics = dynamics;
  options.sheet.areal_density = 0.3;
  options.time.step = h;
  options.force.damping = 2;
  options.material.damping = 5e-3;
  options.elastic.newton_tolerance = 1e-8;
  options.spring.damping = 5e-3;
  options.spring.newton_tolerance = 1e-8;
  options.force.air.density = 1.2;
  options.force.air.wind.velocity = {{0, 1, 0, 2}};
  options.pins["edge"].box = {-1e-3, -1, -1, 1e-3, 1, 1};
  options.pins["edge"].path = there_and_back({-0.05, 0, 0.1}, 0.4);
  if (has_floor) {
    BodyOptions& floor = options.bodies["floor"];
    floor.shape = "plane";
    floor.point = {0, 0, -0.06};
  }
  Alone sheet(grid_mesh(8, 3, 0.05), options);
  const double before = energy_of(sheet);
  while (sheet.state().time < 0.4 - 1e-9) {
    const AloneStep step = sheet.advance(h);
    EXPECT_TRUE(step.converged) << step.reason;
    if (!step.converged) {
      return {};
    }
  }
  return close(before, energy_of(sheet), sheet.state().work);
}

void expect_to_close(const std::function<Closure(double)>& scene, double coarse, double most, const std::string& what) {
  const Closure first = scene(coarse);
  const Closure second = scene(coarse / 2);
  print_once("  %s: open %.4f, %.4f\n", what.c_str(), first.open, second.open);
  EXPECT_GT(first.open, 0) << what << ": steps of implicit Euler damp";
  EXPECT_LT(first.open, most) << what;
  EXPECT_LT(second.open, 0.65 * first.open) << what << ": of first order";
}

TEST(Work, OfASheetBecomesItsEnergy) {
  for (const char* dynamics : {"elastic", "spring"}) {
    expect_to_close([&](double h) { return led_sheet(dynamics, false, h); }, 1e-3, 0.05, dynamics);
  }
}

TEST(Work, EveryKindOfItIsDone) {
  const Closure closure = led_sheet("elastic", true, 1e-3);
  EXPECT_GT(closure.open, 0);
  EXPECT_LT(closure.open, 0.06);
  for (const Work kind : {Work::gravity, Work::damping, Work::pins, Work::bodies, Work::air}) {
    Eigen::VectorXd works = closure.works;
    EXPECT_GT(std::abs(of(works, kind)), 1e-3 * works.cwiseAbs().sum()) << static_cast<int>(kind);
  }
  Eigen::VectorXd works = closure.works;
  EXPECT_LT(of(works, Work::damping), 0);
}

/// A ball that is pumped up and shaken by a pin, and falls on a floor.
Closure shaken_ball(const std::string& law, double h) {
  Options options;
  options.wall.thickness = 0.3e-3;
  options.time.step = h;
  options.prism.mass_damping = 5;
  options.prism.stiffness_damping = 1e-3;
  options.prism.newton = "converged";
  options.chambers["air"].law = law;
  options.gas.links["pump"].to = "air";
  options.gas.links["pump"].flow = {{0, 0.004}, {0.1, 0.004}};
  options.force.air.density = 1.2;
  options.bodies["floor"].shape = "plane";
  options.bodies["floor"].point = {0, 0, -0.055};
  options.pins["hand"].vertices = {0};
  options.pins["hand"].path = there_and_back({0, 0.005, 0.005}, 0.1);
  StaticBalloon ball(icosphere_mesh(1, 0.05), options);
  const double before = energy_of(ball);
  for (int n = 1; n * h < 0.1 + 1e-9; ++n) {
    ball.reach(n * h);
  }
  return close(before, energy_of(ball), ball.state().work);
}

TEST(Work, OfABalloonBecomesItsEnergy) {
  for (const char* law : {"isothermal", "adiabatic"}) {
    expect_to_close([&](double h) { return shaken_ball(law, h); }, 5e-4, 0.2, law);
  }
}

/// Energy of the gas of a ball that is pumped up fast, closed against the work that its wall gets. @returns what of the
/// work of the gas, less that on the air, the wall has not got
double gas_against_wall(double h) {
  Options options;
  options.wall.thickness = 0.3e-3;
  options.time.step = h;
  options.prism.mass_damping = 5;
  options.prism.newton = "converged";
  options.chambers["air"].law = "adiabatic";
  options.gas.links["pump"].to = "air";
  options.gas.links["pump"].flow = {{0, 0.02}, {0.1, 0.02}};
  StaticBalloon ball(icosphere_mesh(1, 0.05), options);
  const double volume = ball.volume();
  for (int n = 1; n * h < 0.1 + 1e-9; ++n) {
    ball.reach(n * h);
  }
  const double of_gas = ball.state().gas->work.sum() - options.gas.ambient_pressure * (ball.volume() - volume);
  const double of_wall = of(ball.state().work, Work::pressure);
  EXPECT_GT(of_gas, 0);
  return of_gas / of_wall - 1;
}

TEST(Work, OfGasIsWhatTheWallGets) {
  const double coarse = gas_against_wall(2e-3);
  const double fine = gas_against_wall(1e-3);
  print_once("  gas against wall: %+.5f, %+.5f\n", coarse, fine);
  EXPECT_LT(std::abs(coarse), 0.02);
  EXPECT_LT(std::abs(fine), 0.65 * std::abs(coarse));
}

}  // namespace
}  // namespace pellicle::work_test
