// The gas of several chambers in a step: those of linked objects, and chambers inside others.

#include "gas/flowing_gas.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "base/error.h"
#include "meshing/closed_shapes.h"
#include "surface/membrane.h"
#include "tests/support/balls.h"
#include "tests/support/grid_mesh.h"

namespace pellicle::flowing_gas_test {
namespace {

ChamberOptions air(double amount_ratio) {
  ChamberOptions gas;
  gas.law = "adiabatic";
  gas.amount_ratio = {{0, amount_ratio}};
  return gas;
}

/// A ball of radius 0.5 in one of radius 1.
struct BallInBall {
  explicit BallInBall(const std::map<std::string, ChamberOptions>& options = both())
      : membrane(make_membrane(PETSC_COMM_WORLD, mesh(), SheetOptions())),
        chambers(membrane, GasOptions(), options),
        flow({{"", &chambers, &gas_step}}) {
    position.values() = membrane.rest;
    exchange = chambers.first_exchange(chambers.volumes(position));
  }

  static SurfaceMesh mesh() {
    return joined(icosphere_mesh(2, 1), icosphere_mesh(2, 0.5), Eigen::Vector3d(0.2, 0, 0.1));
  }
  /// Of higher pressure within. The inner one has the lower number.
  static std::map<std::string, ChamberOptions> both() {
    std::map<std::string, ChamberOptions> options{{"inner", air(1.5)}, {"outer", air(1.2)}};
    options["inner"].vertex = 162;
    options["inner"].inside = "outer";
    options["inner"].hole_discharge = 0.6;
    options["outer"].vertex = 0;
    return options;
  }
  /// Takes the triangles of the inner ball away whose middle is so near to its top.
  void burn_hole(double size) {
    ActiveSet active(membrane);
    for (std::size_t t = 0; t < membrane.triangles.size(); ++t) {
      Eigen::Vector3d middle = Eigen::Vector3d::Zero();
      for (const PetscInt corner : membrane.triangles[t]) {
        middle += membrane.rest.col(corner) / 3;
      }
      active.triangles[t] = membrane.piece[t] == 0 || (middle - Eigen::Vector3d(0.2, 0, 0.6)).norm() > size;
    }
    chambers.set_active(active);
  }
  /// A step in which nothing moves. @returns which ledger does not close
  std::string step(double h) {
    exchange = chambers.recapped(exchange, chambers.volumes(position), 0);
    begin_step(h);
    const FlowingGas::Walls walls{chambers.volumes(position)};
    const GasNetwork::Step begun = flow.network_step(walls, 0);
    exchange = flow.end_step(0, walls, {Eigen::VectorXd::Zero(chambers.count())}, begun, flow.solve(begun));
    return chambers.imbalance(exchange, walls[0], 0);
  }
  void begin_step(double h) {
    gas_step = {&exchange, chambers.walls(exchange, position, Eigen::Vector3d::Zero(), 0), h};
    flow.begin_step();
  }
  std::vector<GasState> states() const { return chambers.states(exchange, chambers.volumes(position), 0); }

  Membrane membrane;
  Chambers chambers;
  GasStep gas_step{&chambers.initial_exchange()};
  FlowingGas flow;
  Field position{membrane.particles, 3};
  GasExchange exchange{0, 0};
};

TEST(NestedChambers, TheOuterGasIsRoundTheInnerWall) {
  const BallInBall balls;
  const Eigen::VectorXd walls = balls.chambers.volumes(balls.position);
  const std::vector<GasState> gas = balls.states();
  EXPECT_DOUBLE_EQ(gas[0].volume, walls[0]);
  EXPECT_DOUBLE_EQ(gas[1].volume, walls[1] - walls[0]);
  EXPECT_DOUBLE_EQ(balls.chambers.initial_volume(1), walls[1] - walls[0]);
  EXPECT_NEAR(gas[0].absolute_pressure, 1.5 * 101325, 1e-6);
  EXPECT_NEAR(gas[1].absolute_pressure, 1.2 * 101325, 1e-6);
  EXPECT_NEAR(gas[0].pressure, 0.3 * 101325, 1e-6) << "across the inner wall";
  EXPECT_NEAR(gas[1].pressure, 0.2 * 101325, 1e-6) << "across the outer one";
}

TEST(NestedChambers, TheSlopesOfAllPressuresAreTheirDerivatives) {
  // Through a hole gas flows from one to the other, while the outer one leaks into the air.
  std::map<std::string, ChamberOptions> options = BallInBall::both();
  options["outer"].permeability = 1e-3;
  options["inner"].heat_transfer = 10;
  BallInBall balls(options);
  balls.burn_hole(0.2);
  balls.begin_step(1e-3);
  const Eigen::VectorXd walls = balls.chambers.volumes(balls.position);
  const auto pressures = [&](const Eigen::VectorXd& at) {
    const GasNetwork::End end = balls.flow.solve(balls.flow.network_step({at}, 0));
    const std::vector<GasState> gas = balls.flow.end_states(0, {at}, 0, end);
    return Eigen::Vector2d(gas[0].pressure, gas[1].pressure);
  };
  const GasNetwork::Step step = balls.flow.network_step({walls}, 0);
  const Eigen::MatrixXd slopes = balls.flow.slopes(step, balls.flow.solve(step));
  for (int wall = 0; wall < 2; ++wall) {
    const double h = 1e-4 * walls[wall];
    const Eigen::VectorXd moved = h * Eigen::VectorXd::Unit(2, wall);
    const Eigen::Vector2d expected = (pressures(walls + moved) - pressures(walls - moved)) / (2 * h);
    EXPECT_LT((slopes.col(wall) - expected).norm(), 1e-6 * expected.norm()) << wall;
  }
}

TEST(NestedChambers, WhatBurnsIntoTheOtherBecomesOneWithIt) {
  BallInBall balls;
  std::vector<GasState> gas = balls.states();
  const double amount = gas[0].amount + gas[1].amount;
  const double volume = gas[0].volume + gas[1].volume;
  const double energy = gas[0].amount * gas[0].temperature + gas[1].amount * gas[1].temperature;
  EXPECT_EQ(balls.step(1e-3), "");
  EXPECT_EQ(balls.exchange.amount.norm(), 0) << "while the wall is whole";

  // Through a small hole it flows until pressures are alike, and nothing gets out.
  balls.burn_hole(0.1);
  for (int n = 0; n < 20; ++n) {
    ASSERT_EQ(balls.step(1e-3), "");
  }
  gas = balls.states();
  EXPECT_LT(balls.exchange.amount[0], -1e-2 * amount);
  EXPECT_NEAR(gas[0].amount + gas[1].amount, amount, 1e-13 * amount);
  EXPECT_NEAR(balls.exchange.leak_amount.sum(), 0, 1e-13 * amount);
  EXPECT_EQ(balls.exchange.gas_inside(0), 0);
  for (int n = 0; n < 2000; ++n) {
    ASSERT_EQ(balls.step(1e-2), "");
  }
  EXPECT_NEAR(balls.states()[0].pressure, 0, 1e-3);
  EXPECT_EQ(balls.exchange.gas_inside(0), 0) << "a small hole";

  // Where a tenth of the wall is gone the two are one.
  balls.burn_hole(0.45);
  ASSERT_EQ(balls.step(1e-2), "");
  EXPECT_EQ(balls.exchange.gas_inside(0), 1);
  ASSERT_EQ(balls.step(1e-2), "");
  gas = balls.states();
  EXPECT_EQ(gas[0].amount, 0);
  EXPECT_EQ(gas[0].pressure, 0);
  EXPECT_NEAR(gas[1].amount, amount, 1e-12 * amount);
  EXPECT_NEAR(gas[1].volume, volume, 1e-12 * volume);
  EXPECT_NEAR(gas[1].amount * gas[1].temperature, energy, 1e-11 * energy) << "no work was done";
  EXPECT_EQ(balls.exchange.open[1], 0);

  // A restart finds the same.
  const Chambers again(balls.membrane, GasOptions(), BallInBall::both(), Eigen::Vector3d::Zero(),
                       balls.chambers.numbers(), &balls.exchange);
  EXPECT_EQ(again.initial_exchange().gas_inside(0), 1);
  EXPECT_EQ(again.vessels(balls.exchange).chambers, std::vector<int>{1});
}

TEST(NestedChambers, AHoleLargerThanItsWallOpensItWhateverThePressuresAre) {
  BallInBall balls;
  balls.burn_hole(0.9);
  ASSERT_EQ(balls.step(1e-9), "");
  EXPECT_EQ(balls.exchange.gas_inside(0), 1);
  const std::vector<GasState> gas = balls.states();
  EXPECT_GT(gas[1].absolute_pressure, 1.21 * 101325);
  EXPECT_LT(gas[1].absolute_pressure, 1.3 * 101325);
}

TEST(NestedChambers, WhatIsNotInsideIsRefused) {
  const auto message = [](const std::function<void(std::map<std::string, ChamberOptions>&)>& change) {
    std::map<std::string, ChamberOptions> options = BallInBall::both();
    change(options);
    try {
      const BallInBall balls(options);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(message([](auto& options) { options["inner"].inside = "box"; }),
            "chambers.inner.inside: there is no chamber box, expected inner, outer");
  EXPECT_EQ(message([](auto& options) { options["outer"].inside = "inner"; }),
            "chambers.inner.inside: outer lies inside it in turn, expected a chamber round it");
  EXPECT_NE(message([](auto& options) {
              std::swap(options["inner"].vertex, options["outer"].vertex);
            }).find("chambers.outer: the piece encloses -3.54"),
            std::string::npos);
  EXPECT_EQ(
      message([](auto& options) {
        options["outer"].law = "pressure";
        options["outer"].amount_ratio.clear();
        options["outer"].pressure = {{0, 1}};
      }),
      "chambers.inner.inside: chamber outer has the law pressure, expected isothermal or adiabatic inside another "
      "chamber and round one");
  EXPECT_EQ(message([](auto& options) { options["outer"].gamma = 1.6; }),
            "chambers.inner.inside: gas flows between chambers of unlike gamma, expected one gas");
  const Membrane beside = make_membrane(
      PETSC_COMM_WORLD, joined(icosphere_mesh(2, 1), icosphere_mesh(2, 0.5), Eigen::Vector3d(2, 0, 0)), SheetOptions());
  try {
    const Chambers chambers(beside, GasOptions(), BallInBall::both());
    ADD_FAILURE() << "no error";
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(),
                 "chambers.inner.inside: its piece does not lie in that of chamber outer, expected a "
                 "chamber round it");
  }
}

}  // namespace
}  // namespace pellicle::flowing_gas_test
