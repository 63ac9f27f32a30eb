// Air in both chains: sheets and balloons that fall, and light ones in long steps.

#include <gtest/gtest.h>

#include <cmath>

#include "meshing/closed_shapes.h"
#include "tests/support/grid_mesh.h"
#include "tests/world/static_balloon.h"

namespace pellicle::air_test {
namespace {

struct FlyingSheet : Alone {
  explicit FlyingSheet(const Options& options) : Alone(grid_mesh(6, 4, 0.05), options) {}

  void go(int steps, double h) {
    for (int step = 0; step < steps; ++step) {
      const AloneStep result = advance(h);
      ASSERT_TRUE(result.converged) << "step " << step + 1 << ": " << result.reason;
    }
  }
};

Options in_still_air() {
  Options options;
  options.force.damping = 0;
  options.force.air.density = 1.2;
  options.force.air.drag = 1.17;
  return options;
}

TEST(Air, FlatSheetFallsAtItsTerminalSpeedWhateverTheStep) {
  for (const double h : {2e-3, 0.1}) {
    Options options = in_still_air();
    options.elastic.newton_tolerance = 1e-10;
    FlyingSheet sheet(options);
    sheet.go(h < 0.01 ? 500 : 12, h);
    const double expected = std::sqrt(2 * 0.08 * 9.81 / (1.2 * 1.17));
    for (PetscInt i = 0; i < sheet.surface().particles.owned; ++i) {
      EXPECT_NEAR(sheet.state().velocity.vector(i)[2], -expected, 1e-6 * expected) << h;
    }
  }
}

TEST(Air, FallFollowsTheHyperbolicTangent) {
  constexpr double h = 1e-3;
  FlyingSheet sheet(in_still_air());
  const double terminal = std::sqrt(2 * 0.08 * 9.81 / (1.2 * 1.17));
  for (int k = 1; k <= 4; ++k) {
    sheet.go(40, h);
    const double expected = terminal * std::tanh(9.81 * 40 * h * k / terminal);
    EXPECT_NEAR(sheet.state().velocity.vector(0)[2], -expected, 5 * h * terminal) << k;
  }
}

TEST(Air, LightPinnedSheetInAGaleIsStableInLongSteps) {
  Options options = in_still_air();
  options.sheet.areal_density = 1e-3;
  options.sheet.perturbation = 0.01;
  options.force.air.skin_drag = 0.02;
  options.force.air.wind.velocity = {{0, 2, 0, 0.3}};
  options.force.air.wind.turbulence = 0.3;
  options.project.max_steps = 30;
  options.pins["mast"].box = {-0.001, -1, -1, 0.001, 1, 1};
  FlyingSheet sheet(options);
  constexpr double h = 0.02;
  for (int k = 0; k < 50; ++k) {
    sheet.go(1, h);
    double fastest = 0;
    for (PetscInt i = 0; i < sheet.surface().particles.owned; ++i) {
      fastest = std::max(fastest, sheet.state().velocity.vector(i).norm());
    }
    ASSERT_LT(fastest, 6) << k;  // three times the wind
  }
}

TEST(Air, BalloonFallsAtItsTerminalSpeed) {
  Options options;
  options.force.air.density = 1.2;
  options.force.gravity = {0, 0, -9.81};
  options.prism.mass_damping = 0;
  options.prism.snes_rtol = 1e-10;
  options.wall.thickness = 1e-5;
  StaticBalloon balloon(icosphere_mesh(1, 0.1), options);
  for (int step = 1; step <= 200; ++step) {
    balloon.reach(0.02 * step);
  }
  // What its triangles take: the sum of C rho/2 A |n_z|^3 over them.
  double sums[2] = {0, 0};
  for (PetscInt e = 0; e < balloon.membrane().elements.owned; ++e) {
    const auto& [a, b, c] = balloon.membrane().triangles[e];
    const Eigen::Vector3d area = (balloon.membrane().rest.col(b) - balloon.membrane().rest.col(a))
                                     .cross(balloon.membrane().rest.col(c) - balloon.membrane().rest.col(a)) /
                                 2;
    sums[0] += 1.2 / 2 * area.norm() * std::pow(std::abs(area.normalized()[2]), 3);
    sums[1] += 1000 * 1e-5 * area.norm() * 9.81;
  }
  MPI_Allreduce(MPI_IN_PLACE, sums, 2, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
  const double expected = std::sqrt(sums[1] / sums[0]);
  // The wall gives way to the air by a little: rubber of 0.4 MPa and 0.01 mm against a pressure of 0.1 Pa.
  for (PetscInt i = 0; i < balloon.membrane().particles.owned; ++i) {
    EXPECT_NEAR(balloon.state().velocity.vector(i)[2], -expected, 0.01 * expected);
  }
}

TEST(Air, WithoutDensityNothingChanges) {
  Options options;
  options.force.air.wind.velocity = {{0, 20, 0, 3}};
  FlyingSheet without((Options()));
  FlyingSheet with(options);
  without.go(5, 2e-3);
  with.go(5, 2e-3);
  EXPECT_EQ(without.state().position.values(), with.state().position.values());
}

}  // namespace
}  // namespace pellicle::air_test
