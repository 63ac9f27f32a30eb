// Caps over the holes of walls: volumes, their derivatives and areas.

#include "gas/rims.h"

#include <gtest/gtest.h>

#include <cmath>

#include "gas/chambers.h"
#include "meshing/closed_shapes.h"
#include "surface/membrane.h"
#include "tests/support/balls.h"

namespace pellicle {
namespace {

constexpr double pi = 3.14159265358979323846;

/// Gas that flows through holes.
ChamberOptions venting() {
  ChamberOptions gas;
  gas.law = "adiabatic";
  gas.hole_discharge = 0.6;
  return gas;
}

/// A ball of radius 1 about (0.3, 0, 0) in whose wall there are holes, its triangles whose middles are within a
/// distance of the poles.
struct Holed {
  explicit Holed(int level, double hole) : membrane(ball(level)), active(membrane) {
    for (std::size_t t = 0; t < membrane.triangles.size(); ++t) {
      Eigen::Vector3d middle = Eigen::Vector3d::Zero();
      for (const PetscInt corner : membrane.triangles[t]) {
        middle += membrane.rest.col(corner) / 3;
      }
      middle.x() -= 0.3;
      active.triangles[t] = middle.head<2>().norm() > (middle.z() > 0 ? hole : hole / 2);
    }
    chambers.emplace(membrane, GasOptions(), std::map<std::string, ChamberOptions>{{"gas", venting()}});
    chambers->set_active(active);
    position.values() = membrane.rest;
  }
  static Membrane ball(int level) {
    SurfaceMesh mesh = icosphere_mesh(level, 1);
    for (Eigen::Vector3d& point : mesh.points) {
      point.x() += 0.3;
    }
    return make_membrane(PETSC_COMM_WORLD, mesh, SheetOptions());
  }

  Membrane membrane;
  ActiveSet active;
  std::optional<Chambers> chambers;
  Field position{membrane.particles, 3};
};

TEST(Rims, ACapClosesAnOpenMesh) {
  // Of half a ball: area and volume converge with the square of the triangles' size.
  std::vector<Eigen::Vector2d> errors;
  for (const int level : {2, 3, 4}) {
    const Membrane membrane = make_membrane(PETSC_COMM_WORLD, dome_mesh(level, 1), SheetOptions());
    const Chambers chambers(membrane, GasOptions(), {{"gas", venting()}}, {0.3, 0.2, -0.5});
    Field position(membrane.particles, 3);
    position.values() = membrane.rest;
    errors.emplace_back(
        chambers.walls(chambers.initial_exchange(), position, Eigen::Vector3d::Zero(), 0).hole_area[0] / pi - 1,
        chambers.volumes(position)[0] / (2 * pi / 3) - 1);
  }
  for (int k = 0; k < 2; ++k) {
    EXPECT_NEAR(errors[1][k] / errors[2][k], 4, 0.1) << k;
    EXPECT_LT(std::abs(errors[2][k]), 0.01) << k;
  }
}

TEST(Rims, AJetPushesTheWholeAgainstTheFlow) {
  // With the larger hole above and the smaller below: the difference of the areas times C 2 dp, for a small dp.
  Holed ball(4, 0.5);
  GasExchange exchange(1, 0);
  const double pressure = 100;  // [Pa]
  const double amount = ball.chambers->state(0, 1, 0).amount;
  const double v0 = ball.chambers->initial_volume(0);
  const double volume = ball.chambers->volumes(ball.position)[0];
  // As much gas as gives the pressure in the capped volume at 293.15 K.
  const double filled = (101325 + pressure) * volume / (gas_constant * 293.15);
  exchange.amount[0] = filled - amount;
  exchange.heat[0] = filled * 293.15 * std::pow(volume / v0, 0.4) - amount * 293.15;
  EXPECT_NEAR(ball.chambers->state(exchange, 0, volume, 0).pressure, pressure, 1e-6);
  const Eigen::Matrix3Xd force = ball.chambers->uneven_forces(exchange, ball.position, Eigen::Vector3d::Zero(), 0) +
                                 pressure * ball.chambers->volume_gradient(0, ball.position);
  Eigen::Vector3d sum = force.rowwise().sum();
  MPI_Allreduce(MPI_IN_PLACE, sum.data(), 3, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
  EXPECT_NEAR(sum.z(), -0.6 * 2 * pressure * pi * (0.25 - 0.0625), 0.1 * 0.6 * 2 * pressure * pi * 0.19);
  EXPECT_NEAR(sum.head<2>().norm(), 0, 0.02 * std::abs(sum.z()));
}

TEST(Rims, AChamberWhoseWallIsCutInTwoBecomesTwoByVolume) {
  // A band round a ball about z = 0.3 is gone, and a little cap below, which floats: it bounds nothing.
  Membrane membrane = Holed::ball(3);
  const std::map<std::string, ChamberOptions> options{{"gas", venting()}};
  Chambers chambers(membrane, GasOptions(), options);
  Field position(membrane.particles, 3);
  position.values() = membrane.rest;
  ActiveSet active(membrane);
  std::vector<PetscInt> piece(membrane.particles.local());
  for (std::size_t i = 0; i < piece.size(); ++i) {
    const double z = membrane.rest(2, static_cast<Eigen::Index>(i));
    piece[i] = z > 0.3 ? 1 : z > -0.97 ? 0 : 2;
  }
  for (std::size_t t = 0; t < membrane.triangles.size(); ++t) {
    const auto of = [&](std::size_t k) { return piece[membrane.triangles[t][k]]; };
    active.triangles[t] = of(0) == of(1) && of(1) == of(2);
  }
  GasExchange exchange = chambers.first_exchange(chambers.volumes(position));
  EXPECT_FALSE(chambers.divided(std::vector<PetscInt>(piece.size(), 0), exchange, position, 0));
  chambers.set_active(active);
  const double volume = chambers.volumes(position)[0];
  exchange = chambers.first_exchange(chambers.volumes(position));
  EXPECT_EQ(chambers.recapped(exchange, chambers.volumes(position), 0).amount[0], exchange.amount[0]);
  const GasState before = chambers.state(0, volume, 0);

  // A cap that moves leaves the gas as it is, and what it leaves outside has leaked.
  const GasExchange shifted = chambers.recapped(exchange, Eigen::VectorXd::Constant(1, 0.9 * volume), 0);
  EXPECT_NEAR(shifted.leak_amount[0], 0.1 * before.amount, 1e-12 * before.amount);
  EXPECT_NEAR(chambers.state(shifted, 0, 0.9 * volume, 0).pressure, before.pressure, 1e-9 * before.absolute_pressure);
  EXPECT_NEAR(chambers.state(shifted, 0, 0.9 * volume, 0).temperature, before.temperature, 1e-10 * before.temperature);
  EXPECT_EQ(chambers.imbalance(shifted, Eigen::VectorXd::Constant(1, 0.9 * volume), 0), "");

  const std::optional<Chambers::Division> division = chambers.divided(piece, exchange, position, 0);
  ASSERT_TRUE(division);
  ASSERT_EQ(division->exchange.chambers(), 2);
  EXPECT_EQ(division->lines.size(), 1U);
  Chambers parts(membrane, GasOptions(), options, Eigen::Vector3d::Zero(), division->numbers, &division->exchange);
  EXPECT_EQ(parts.name(0), "gas");
  EXPECT_EQ(parts.name(1), "gas_cut");
  parts.set_active(active);
  const Eigen::VectorXd volumes = parts.volumes(position);
  EXPECT_NEAR(volumes.sum(), volume, 1e-3 * volume) << "but for the little cap";
  EXPECT_NEAR(volumes[1] / volumes.sum(), 0.7 * 0.7 * (3 - 0.7) / 4, 0.06) << "of a ball's cap of height 0.7";
  double amount = 0;
  for (const int part : {0, 1}) {
    const GasState gas = parts.state(division->exchange, part, volumes[part], 0);
    amount += gas.amount;
    EXPECT_NEAR(gas.temperature, before.temperature, 1e-10 * before.temperature);
    EXPECT_NEAR(gas.absolute_pressure, before.absolute_pressure, 1e-10 * before.absolute_pressure);
  }
  EXPECT_NEAR(amount + division->exchange.leak_amount[0], before.amount, 1e-12 * amount);
  EXPECT_EQ(parts.imbalance(division->exchange, volumes, 0), "");
  EXPECT_FALSE(parts.divided(piece, division->exchange, position, 0));

  // A ledger that does not close is named.
  GasExchange wrong = division->exchange;
  wrong.leak_amount[1] += 1e-6;
  EXPECT_NE(parts.imbalance(wrong, volumes, 0).find("the ledger of the amount in chamber gas is off by 1e-06 mol"),
            std::string::npos)
      << parts.imbalance(wrong, volumes, 0);
  wrong = division->exchange;
  wrong.work[0] += 1;
  EXPECT_NE(parts.imbalance(wrong, volumes, 0).find("the ledger of the energy in chamber gas is off by 1 J"),
            std::string::npos)
      << parts.imbalance(wrong, volumes, 0);
}

}  // namespace
}  // namespace pellicle
