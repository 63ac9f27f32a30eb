#include "heat/heat_balance.h"

#include <gtest/gtest.h>

#include "parallel/collective.h"
#include "tests/heat/sheets.h"

namespace pellicle {
namespace {

constexpr double stefan_boltzmann = 5.670374419e-8;

double added(const HeatExchange& exchange) { return exchange.gained - exchange.lost; }

class HeatBalance : public ::testing::Test {
 protected:
  HeatBalance()
      : sheet_(shell_of(grid_mesh(6, 5, 0.1), 0.03)),
        positions_(rest_positions(sheet_)),
        mass_(initial_masses(sheet_)) {}

  Field uniform(double value) {
    return field_of(sheet_, [=](const Eigen::Vector3d&) { return value; });
  }

  /// Loses heat in equal steps and returns the heat added, of all ranks.
  double lose(Field& temperature, double time, int steps, const HeatOptions& options) {
    double heat = 0;
    for (int n = 0; n < steps; ++n) {
      heat += added(
          exchange_with_surroundings(temperature, sheet_, positions_, mass_, ActiveSet(sheet_), time / steps, options));
    }
    return sum_over_ranks(PETSC_COMM_WORLD, heat);
  }

  Sheet sheet_;
  Field positions_;
  Field mass_;
};

TEST_F(HeatBalance, AreasAddUpAndFollowTheMasses) {
  const Eigen::VectorXd areas = particle_areas(sheet_, positions_, ActiveSet(sheet_));
  EXPECT_NEAR(sum_over_ranks(PETSC_COMM_WORLD, areas.sum()), 0.6 * 0.5, 1e-14);
  for (PetscInt i = 0; i < sheet_.particles.owned; ++i) {
    EXPECT_NEAR(areas[i] * test_density, sheet_.initial_mass[i], 1e-16);
  }
}

// Half of the width dead, and of one more cell the triangle at its edge of least x: of its quarter of the cell it takes
// half from the lattice point.
TEST_F(HeatBalance, DeadTrianglesHaveNoAreaAndLoseNothing) {
  const ActiveSet active =
      without(sheet_, [](const Eigen::Vector3d& x) { return x.x() < 0.3 || (x.x() < 0.32 && x.y() < 0.1); });
  const Eigen::VectorXd areas = particle_areas(sheet_, positions_, active);
  EXPECT_NEAR(sum_over_ranks(PETSC_COMM_WORLD, areas.sum()), 0.3 * 0.5 - 0.01 / 4, 1e-14);
  HeatOptions options;
  options.convection = 12;
  Field temperature = uniform(700);
  const double before = sum_over_ranks(PETSC_COMM_WORLD, heat_content(sheet_, mass_, temperature, options.capacity));
  const double heat = sum_over_ranks(
      PETSC_COMM_WORLD, added(exchange_with_surroundings(temperature, sheet_, positions_, mass_, active, 1, options)));
  EXPECT_NEAR(sum_over_ranks(PETSC_COMM_WORLD, heat_content(sheet_, mass_, temperature, options.capacity)),
              before + heat, 1e-12 * before);
  const double rate = 2 * options.convection / (test_density * options.capacity);
  for (PetscInt i = 0; i < sheet_.particles.owned; ++i) {
    const Eigen::Vector3d x = sheet_.rest.col(i);
    double fraction = x.x() < 0.29 ? 0 : x.x() < 0.31 ? 0.5 : 1;
    if (x.y() < 0.11) {
      fraction -= sheet_.is_lattice[i] && x.x() > 0.3 && x.x() < 0.4 ? 0.25 : 0;
      fraction -= std::abs(x.x() - 0.3) < 0.01 ? (x.y() < 0.01 ? 0.25 : 0.125) : 0;
    }
    EXPECT_NEAR(temperature.data()[i], 300 + 400 * std::exp(-fraction * rate), 1e-10) << x.transpose();
  }
}

TEST_F(HeatBalance, ParticlesThatHaveLeftTakeNoPart) {
  HeatOptions options;
  options.convection = 12;
  options.burning_heat = 300;
  const auto has_left = [this](PetscInt i) { return sheet_.rest(0, i) < 0.26; };
  Field change(sheet_.particles, 1);
  for (PetscInt i = 0; i < sheet_.particles.local(); ++i) {
    change.data()[i] = -0.1 * mass_.data()[i];
    mass_.data()[i] *= has_left(i) ? 0 : 0.9;
  }
  Field temperature = uniform(700);
  const double before = sum_over_ranks(PETSC_COMM_WORLD, heat_content(sheet_, mass_, temperature, options.capacity));
  HeatSource source;
  source.radius = 3;
  const HeatSourceInput input{sheet_, positions_, mass_, {}, 0, 0.01, options.capacity};
  double heat = apply_heat_source(temperature, source, input);
  heat += release_burning_heat(temperature, sheet_, change, mass_, options);
  heat += added(exchange_with_surroundings(temperature, sheet_, positions_, mass_, ActiveSet(sheet_), 0.01, options));
  EXPECT_NEAR(sum_over_ranks(PETSC_COMM_WORLD, heat_content(sheet_, mass_, temperature, options.capacity)),
              before + sum_over_ranks(PETSC_COMM_WORLD, heat), 1e-12 * before);
  for (PetscInt i = 0; i < sheet_.particles.local(); ++i) {
    EXPECT_EQ(temperature.data()[i] == 700, has_left(i));
  }
}

TEST_F(HeatBalance, WhatWarmsGainsAndWhatCoolsLoses) {
  HeatOptions options;
  options.convection = 12;
  options.ambient_temperature = 500;
  Field temperature = field_of(sheet_, [](const Eigen::Vector3d& x) { return x.x() < 0.31 ? 400.0 : 700.0; });
  const Field before = field_of(sheet_, [](const Eigen::Vector3d& x) { return x.x() < 0.31 ? 400.0 : 700.0; });
  const HeatExchange exchange =
      exchange_with_surroundings(temperature, sheet_, positions_, mass_, ActiveSet(sheet_), 1, options);
  double gained = 0;
  double lost = 0;
  for (PetscInt i = 0; i < sheet_.particles.owned; ++i) {
    const double heat = options.capacity * mass_.data()[i] * (temperature.data()[i] - before.data()[i]);
    (sheet_.rest(0, i) < 0.31 ? gained : lost) += std::abs(heat);
  }
  EXPECT_GT(sum_over_ranks(PETSC_COMM_WORLD, gained), 0);
  EXPECT_GT(sum_over_ranks(PETSC_COMM_WORLD, lost), 0);
  EXPECT_NEAR(exchange.gained, gained, 1e-12 * gained);
  EXPECT_NEAR(exchange.lost, lost, 1e-12 * lost);
}

TEST_F(HeatBalance, NothingIsLostUnlessAsked) {
  Field temperature = uniform(900);
  EXPECT_EQ(lose(temperature, 1, 1, HeatOptions()), 0);
  EXPECT_EQ(temperature.values().maxCoeff(), 900);
}

// Both sides of area A: T - T_amb decays at the rate 2 h_c A / (m c) = 2 h_c / (sigma c), exactly for any step.
TEST_F(HeatBalance, ConvectionDecaysExponentially) {
  HeatOptions options;
  options.convection = 12;
  options.ambient_temperature = 290;
  const double rate = 2 * options.convection / (test_density * options.capacity);
  for (const int steps : {1, 7}) {
    Field temperature = uniform(700);
    const double before = sum_over_ranks(PETSC_COMM_WORLD, heat_content(sheet_, mass_, temperature, options.capacity));
    const double heat = lose(temperature, 3, steps, options);
    const double expected = 290 + 410 * std::exp(-3 * rate);
    for (PetscInt i = 0; i < sheet_.particles.local(); ++i) {
      EXPECT_NEAR(temperature.data()[i], expected, 1e-10);
    }
    EXPECT_LT(heat, 0);
    EXPECT_NEAR(sum_over_ranks(PETSC_COMM_WORLD, heat_content(sheet_, mass_, temperature, options.capacity)),
                before + heat, 1e-12 * before);
  }
}

// Into surroundings at 0 K: T^-3 = T_0^-3 + 6 epsilon sigma t / (areal density c).
TEST_F(HeatBalance, RadiationConvergesAtSecondOrder) {
  HeatOptions options;
  options.emissivity = 0.9;
  options.ambient_temperature = 0;
  const double expected =
      std::pow(std::pow(1000.0, -3) + 6 * 0.9 * stefan_boltzmann * 2 / (test_density * options.capacity), -1.0 / 3);
  std::vector<double> errors;
  for (const int steps : {10, 20, 40}) {
    Field temperature = uniform(1000);
    lose(temperature, 2, steps, options);
    errors.push_back(max_over_ranks(PETSC_COMM_WORLD, std::abs(temperature.values()(0, 0) - expected)));
  }
  EXPECT_LT(errors[2], 0.2);
  EXPECT_GT(errors[0] / errors[1], 3.7);
  EXPECT_GT(errors[1] / errors[2], 3.7);
}

TEST_F(HeatBalance, AHugeStepEndsAtTheSurroundings) {
  HeatOptions options;
  options.convection = 10;
  options.emissivity = 1;
  for (const double start : {100.0, 2000.0}) {
    Field temperature = uniform(start);
    lose(temperature, 1e9, 1, options);
    EXPECT_NEAR(temperature.values().maxCoeff(), options.ambient_temperature, 1e-9);
    EXPECT_NEAR(temperature.values().minCoeff(), options.ambient_temperature, 1e-9);
  }
}

TEST_F(HeatBalance, BurningHeatsByEtaTimesTheLostFraction) {
  HeatOptions options;
  options.burning_heat = 300;
  Field change(sheet_.particles, 1);
  for (PetscInt i = 0; i < sheet_.particles.local(); ++i) {
    change.data()[i] = -0.01 * sheet_.rest(0, i) * mass_.data()[i];
    mass_.data()[i] += change.data()[i];
  }
  Field temperature = uniform(500);
  const double before = sum_over_ranks(PETSC_COMM_WORLD, heat_content(sheet_, mass_, temperature, options.capacity));
  const double heat =
      sum_over_ranks(PETSC_COMM_WORLD, release_burning_heat(temperature, sheet_, change, mass_, options));
  for (PetscInt i = 0; i < sheet_.particles.local(); ++i) {
    EXPECT_NEAR(temperature.data()[i], 500 + 3 * sheet_.rest(0, i), 1e-10);
  }
  EXPECT_GT(heat, 0);
  EXPECT_NEAR(sum_over_ranks(PETSC_COMM_WORLD, heat_content(sheet_, mass_, temperature, options.capacity)),
              before + heat, 1e-12 * before);
}

}  // namespace
}  // namespace pellicle
