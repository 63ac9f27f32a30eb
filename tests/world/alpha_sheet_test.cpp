// Sheets by generalized alpha: constant forces are exact, energy is conserved, and errors are of second order.

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "meshing/closed_shapes.h"
#include "parallel/collective.h"
#include "tests/io/files.h"
#include "tests/support/alone.h"
#include "tests/support/by_id.h"
#include "tests/support/grid_mesh.h"

namespace pellicle::alpha_sheet_test {
namespace {

constexpr double edge = 0.1;  // [m]

Options alpha_options(Dynamics dynamics = Dynamics::elastic) {
  Options options;
  options.dynamics = dynamics;
  options.time.scheme = TimeScheme::generalized_alpha;
  options.time.spectral_radius = 1;
  options.sheet.thickness = 0.02;
  options.force.gravity.setZero();
  options.force.damping = 0;
  options.material.damping = 0;
  options.spring.damping = 0;
  options.elastic.newton_tolerance = 1e-11;
  options.elastic.ksp_rtol = 1e-10;
  options.spring.snes_rtol = 1e-11;
  options.spring.ksp_rtol = 1e-10;
  return options;
}

/// A sheet whose particles move apart from its middle, in its plane.
class BreathingSheet : public Alone {
 public:
  explicit BreathingSheet(const Options& options) : Alone(grid_mesh(4, 4, edge), options) {
    const Eigen::Vector3d middle(2 * edge, 2 * edge, 0);
    for (PetscInt i = 0; i < surface().particles.local(); ++i) {
      Eigen::Vector3d velocity = 2 * (surface().rest.col(i) - middle);
      velocity.z() = 0;
      state().velocity.vector(i) = velocity;
    }
  }

  /// Steps of length h [s] to a time [s]. @returns the positions of all ranks by id
  Eigen::MatrixXd reach(double time, double h) {
    const auto steps = static_cast<int>(std::lround(time / h));
    for (int n = 0; n < steps; ++n) {
      const AloneStep step = advance(h);
      EXPECT_TRUE(step.converged) << step.reason;
    }
    return by_id(surface(), state().position);
  }
  double energy() const { return figure("kinetic_energy") + figure("elastic_energy"); }
};

class AlphaSheet : public ::testing::TestWithParam<Dynamics> {};

TEST_P(AlphaSheet, FallsExactly) {
  Options options = alpha_options(GetParam());
  options.force.gravity = {0.5, 0, -9.81};
  options.time.spectral_radius = 0.6;
  Alone sheet(grid_mesh(3, 2, edge), options);
  constexpr double h = 5e-3;
  for (int n = 1; n <= 8; ++n) {
    const AloneStep step = sheet.advance(h);
    ASSERT_TRUE(step.converged) << step.reason;
    const Eigen::Vector3d fallen = options.force.gravity * std::pow(n * h, 2) / 2;
    for (PetscInt i = 0; i < sheet.surface().particles.owned; ++i) {
      EXPECT_NEAR((sheet.state().position.vector(i) - sheet.surface().rest.col(i) - fallen).norm(), 0, 1e-11);
    }
  }
  EXPECT_NEAR(sheet.figure("gravity_work"), sheet.figure("kinetic_energy"), 1e-9 * sheet.figure("kinetic_energy"));
}

TEST_P(AlphaSheet, ConservesEnergy) {
  BreathingSheet sheet(alpha_options(GetParam()));
  sheet.reach(1e-3, 1e-3);
  const double before = sheet.energy();
  EXPECT_GT(before, 0);
  double largest = 0;
  for (int n = 0; n < 60; ++n) {
    ASSERT_TRUE(sheet.advance(1e-3).converged);
    largest = std::max(largest, sheet.figure("elastic_energy"));
    EXPECT_NEAR(sheet.energy(), before, 0.02 * before) << "step " << n;
  }
  EXPECT_GT(largest, 0.3 * before) << "it does not swing";

  Options euler = alpha_options(GetParam());
  euler.time.scheme = TimeScheme::implicit_euler;
  BreathingSheet damped(euler);
  damped.reach(0.06, 1e-3);
  EXPECT_LT(damped.energy(), 0.7 * before) << "by implicit Euler much of it would be gone";
}

// With 0.01 the flag of input/flag.yaml gains energy.
TEST(ElasticAlphaSheet, IsBroughtCloserIntoBalanceThanByImplicitEuler) {
  Options options;
  EXPECT_EQ(elastic_options(options).snes_rtol, 1e-2);
  options.time.scheme = TimeScheme::generalized_alpha;
  EXPECT_EQ(elastic_options(options).snes_rtol, 1e-4);
  options.elastic.newton_tolerance = 0.1;
  EXPECT_EQ(elastic_options(options).snes_rtol, 0.1);
}

// The accelerations from which the first step goes on follow from viscosity, too. They have no effect by the midpoint
// rule, a spectral radius of 1.
TEST_P(AlphaSheet, ErrorsAreOfSecondOrder) {
  constexpr double time = 4e-3;  // [s]
  for (const auto& [viscosity, spectral_radius] : {std::pair(0.0, 1.0), {3e-4, 0.6}}) {
    Options options = alpha_options(GetParam());
    options.time.spectral_radius = spectral_radius;
    options.material.damping = viscosity;
    options.spring.damping = viscosity;
    const auto at = [&options](double h) { return BreathingSheet(options).reach(time, h); };
    const Eigen::MatrixXd fine = at(time / 512);
    const double coarse = (at(time / 32) - fine).norm();
    const double half = (at(time / 64) - fine).norm();
    EXPECT_GT(coarse, 1e-6) << "too small to be told from rounding";
    EXPECT_NEAR(std::log2(coarse / half), 2, 0.25) << viscosity;
  }
}

TEST_P(AlphaSheet, FadesAsItIsDamped) {
  Options options = alpha_options(GetParam());
  options.force.damping = 5;
  Alone sheet(grid_mesh(3, 2, edge), options);
  sheet.state().velocity.values().colwise() = Eigen::Vector3d(1, 0, 0);
  for (int n = 0; n < 20; ++n) {
    ASSERT_TRUE(sheet.advance(5e-3).converged);
  }
  const double expected = std::exp(-5 * 0.1);
  const double mass = 0.08 * 6 * edge * edge;
  EXPECT_NEAR(sheet.figure("momentum_x") / mass, expected, 1e-4);
  EXPECT_NEAR(sheet.figure("damping_work"), mass / 2 * (expected * expected - 1), 1e-3 * mass);
}

INSTANTIATE_TEST_SUITE_P(Kinds, AlphaSheet, ::testing::Values(Dynamics::elastic, Dynamics::spring),
                         [](const auto& dynamics) { return Choice<Dynamics>(dynamics.param).name(); });

TEST(AlphaSheet, AProjectedSheetHasNoForces) {
  EXPECT_EQ(error_text([] { require_possible(alpha_options(Dynamics::projection)); }),
            "time.scheme: generalized_alpha does not go with dynamics: projection, whose springs have no forces, "
            "expected implicit_euler");
}

// Already in the first step, if the accelerations from which it goes on include the lift.
TEST(AlphaSheet, WarmGasLiftsItByTheWeightOfTheAirThatItDisplaces) {
  Options options = alpha_options();
  options.time.spectral_radius = 0.6;  // With 1 these accelerations would have no effect.
  options.force.gravity = {0, 0, -9.81};
  options.material.tensile_stiffness = 2000;
  options.gas.buoyancy = true;
  options.chambers["air"].law = GasLaw::isothermal;
  options.chambers["air"].temperature = {{0, 500}};
  Alone bag(quad_ellipsoid_mesh(2, {0.1, 0.1, 0.1}), options, ChainKind::burn);
  const double density = 101325 * options.gas.molar_mass / (gas_constant * 293.15);
  const double lift = density * (1 - 293.15 / 500) * bag.figure("gas_volume") * 9.81;
  const double weight = 9.81 * bag.figure("mass_left");
  ASSERT_TRUE(bag.advance(1e-4).converged);
  EXPECT_NEAR(bag.figure("momentum_z"), 1e-4 * (lift - weight), 1e-3 * 1e-4 * lift);
}

TEST(AlphaSheet, GasPressesWhereForcesAreInBalance) {
  // A closed bag of little stiffness swings about the volume of its gas: the work of the gas is what its energy loses.
  Options options = alpha_options();
  options.material.tensile_stiffness = 2000;
  options.chambers["air"].law = GasLaw::isothermal;
  options.chambers["air"].amount_ratio = {{0, 1.02}};
  Alone bag(quad_ellipsoid_mesh(2, {0.1, 0.1, 0.1}), options, ChainKind::burn);
  double swing = 0;
  for (int n = 0; n < 40; ++n) {
    const AloneStep step = bag.advance(2e-4);
    ASSERT_TRUE(step.converged) << step.reason;
    swing = std::max(swing, bag.figure("gas_volume_ratio"));
  }
  EXPECT_GT(swing, 1.002);
  const double energy = bag.figure("kinetic_energy") + bag.figure("elastic_energy");
  EXPECT_NEAR(bag.figure("pressure_work"), energy, 0.02 * energy);
}

}  // namespace
}  // namespace pellicle::alpha_sheet_test
