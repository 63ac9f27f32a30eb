// Gas that flows in and out of balloons and takes heat from their walls: amounts, energies and times against formulas.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "meshing/closed_shapes.h"
#include "meshing/triangulation.h"
#include "tests/support/balls.h"
#include "tests/support/grid_mesh.h"
#include "tests/world/static_balloon.h"

namespace pellicle::flowing_gas_test {
namespace {

constexpr double pi = 3.14159265358979323846;

/// A thin ball of rubber, 50 mm in radius: s1 0.3 MPa, K 0.1, constrained by planes of symmetry.
Options rubber_ball() {
  Options options = static_options();
  options.wall.thickness = 0.2e-3;
  options.wall.material.law = "mooney_rivlin";
  options.wall.material.c1 = 0.15e6;
  options.wall.material.c2 = 0.015e6;
  options.wall.bending = "none";
  options.symmetry["x"].normal = {1, 0, 0};
  options.symmetry["y"].normal = {0, 1, 0};
  options.symmetry["z"].normal = {0, 0, 1};
  return options;
}

LinkOptions hole(const std::string& from, double area) {
  LinkOptions link;
  link.from = from;
  link.area = area;
  return link;
}

LinkOptions pump(const std::string& to, const Rows& flow) {
  LinkOptions link;
  link.to = to;
  link.flow = flow;
  return link;
}

SurfaceMesh round_ball(int level) {
  SurfaceMesh mesh = icosphere_mesh(level, 0.05);
  const double scale = std::cbrt(4 * pi / 3 * std::pow(0.05, 3) / enclosed_volume(mesh));
  for (Eigen::Vector3d& point : mesh.points) {
    point *= scale;
  }
  return mesh;
}

TEST(FlowingGas, ABalloonEmptiesThroughAHoleInTheTimeOfTheQuadrature) {
  // From a radius of 150 mm to 60 mm through a hole of 5 mm: 13.303 s by quadrature (input/leaking_balloon.yaml).
  Options options = rubber_ball();
  options.chambers["air"].law = GasLaw::isothermal;
  options.chambers["air"].temperature = {{0, 293}};
  options.gas.links["pump"] = pump("air", {{0, 0.28752}, {2, 0.28752}, {2.001, 0}});
  options.gas.links["hole"] = hole("air", pi / 4 * std::pow(5e-3, 2));
  options.gas.links["hole"].opens = {{2, 0}, {2.001, 1}};
  StaticBalloon balloon(round_ball(2), options);
  const auto radius = [&] { return std::cbrt(3 * balloon.volume() / (4 * pi)); };
  balloon.go_to(2, 0.05);
  EXPECT_NEAR(radius(), 0.15, 2e-5);
  double last = radius();
  double highest = 0;
  while (last > 0.06 && balloon.state().time < 20) {
    const double before = last;
    balloon.reach(balloon.state().time + 0.05);
    last = radius();
    highest = std::max(highest, balloon.pressure());
    if (last <= 0.06) {
      EXPECT_NEAR(balloon.state().time - 2 - 0.05 * (0.06 - last) / (before - last), 13.303, 0.01 * 13.303);
    }
  }
  EXPECT_NEAR(highest, 1788.7, 10);
}

/// Two balls side by side, each a piece. @param ratio of the second's radius to the first's
SurfaceMesh two_balls(double ratio) {
  return joined(icosphere_mesh(1, 0.05), icosphere_mesh(1, ratio * 0.05), {0.5, 0, 0});
}

TEST(FlowingGas, AmountsAndEnergiesOfANetworkAreConserved) {
  // U + work - heat of the wall - what pumps brought + what left stays the same to rounding.
  Options options = rubber_ball();
  options.symmetry.clear();
  options.prism.inertia = true;
  options.prism.mass_damping = 20;
  ChamberOptions& air = options.chambers["air"];
  air.law = GasLaw::adiabatic;
  air.heat_transfer = 50;
  air.wall_temperature = 350;
  air.permeability = 1e-6;
  options.gas.links["pump"] = pump("air", {{0, 0.05}});
  options.gas.links["pump"].temperature = 600;
  options.gas.links["tube"] = hole("air", 1e-4);
  options.gas.links["tube"].to = "air_2";
  options.gas.links["vent"] = hole("air_2", 1e-6);
  StaticBalloon balloon(two_balls(1.05), options);
  const auto value = [&](const std::string& name) { return balloon.figure(name); };
  const double amount = value("gas_amount");
  const double energy = value("gas_energy");
  for (int step = 1; step <= 40; ++step) {
    if (step % 20 == 0) {  // A step that is taken back leaves nothing behind.
      balloon.object.keep();
      balloon.reach(5e-3 * step);
      balloon.object.restore();
    }
    balloon.reach(5e-3 * step);
    const double brought = value("through_pump") - value("through_vent") - value("gas_leak");
    EXPECT_NEAR(value("gas_amount"), amount + brought, 1e-13 * amount);
    const double carried = value("enthalpy_pump") - value("enthalpy_vent") - value("gas_leak_enthalpy");
    EXPECT_NEAR(value("gas_energy") + value("gas_work"), energy + carried + value("gas_wall_heat"), 1e-11 * energy);
  }
  EXPECT_NEAR(value("through_pump"), 0.05 * 0.2, 1e-12);
  for (const char* name : {"through_tube", "through_vent", "gas_leak", "gas_wall_heat"}) {
    EXPECT_NE(value(name), 0) << name;
  }
  EXPECT_GT(value("gas_temperature_air"), value("gas_temperature_air_2"));
}

TEST(FlowingGas, OfTwoBalloonsBeyondTheHighestPressureOneTakesTheGasOfTheOther) {
  // Before the highest pressure (1.46 of the radius) what is different becomes alike.
  for (const bool is_beyond : {false, true}) {
    Options options = rubber_ball();
    options.symmetry.clear();
    options.prism.inertia = true;
    options.prism.mass_damping = 50;
    options.chambers["air"].law = GasLaw::isothermal;
    const double flow = is_beyond ? 0.1 : 0.02;
    options.gas.links["pump"] = pump("air", {{0, flow}, {1, flow}, {1.01, 0}});
    options.gas.links["pump_2"] = pump("air_2", {{0, 0.9 * flow}, {1, 0.9 * flow}, {1.01, 0}});
    options.gas.links["tube"] = hole("air", 4e-4);
    options.gas.links["tube"].to = "air_2";
    options.gas.links["tube"].opens = {{1, 0}, {1.1, 1}};
    StaticBalloon balloons(two_balls(1), options);
    const auto ratio = [&] {
      const Eigen::VectorXd volumes = balloons.chambers().volumes(balloons.state().position);
      return volumes[0] / volumes[1];
    };
    balloons.go_to(1, 0.02);
    const double before = ratio();
    balloons.go_to(4, 0.02);
    if (is_beyond) {
      EXPECT_GT(before, 1.05);
      EXPECT_GT(ratio(), 3);
    } else {
      EXPECT_GT(before, 1.02);
      EXPECT_NEAR(ratio(), 1, 5e-3);
    }
  }
}

TEST(FlowingGas, OfFiveBalloonsAtMostOneIsOnTheFallingBranch) {
  // Mooney and Rivlin with K = 0.1: the pressure falls between the stretches 1.476 and 3.143.
  constexpr int count = 5;
  Options options = rubber_ball();
  options.symmetry.clear();
  options.prism.inertia = true;
  options.prism.mass_damping = 50;
  options.chambers["air"].law = GasLaw::isothermal;
  const auto name = [](int ball) { return ball == 0 ? "air" : "air_" + std::to_string(ball + 1); };
  SurfaceMesh mesh = icosphere_mesh(1, 0.05);
  for (int ball = 0; ball < count; ++ball) {
    if (ball > 0) {
      mesh = joined(mesh, icosphere_mesh(1, 0.05), {0.5 * ball, 0, 0});
      LinkOptions& tube = options.gas.links["tube_" + std::to_string(ball)] = hole(name(ball - 1), 8e-4);
      tube.to = name(ball);
      tube.opens = {{1, 0}, {1.1, 1}};
    }
    const double flow = 0.1 * (1 - 0.03 * ball);
    options.gas.links["pump_" + std::to_string(ball)] = pump(name(ball), {{0, flow}, {1, flow}, {1.01, 0}});
  }
  StaticBalloon balloons(mesh, options);
  const auto falling = [&] {
    const Chambers& chambers = balloons.chambers();
    const Eigen::VectorXd volumes = chambers.volumes(balloons.state().position);
    int on_it = 0;
    for (int ball = 0; ball < count; ++ball) {
      const double stretch = std::cbrt(volumes[ball] / chambers.initial_volume(ball));
      on_it += stretch > 1.476 && stretch < 3.143 ? 1 : 0;
    }
    return on_it;
  };
  balloons.go_to(1, 0.02);
  EXPECT_EQ(falling(), count) << "while no tube is open";
  balloons.go_to(6, 0.04);
  EXPECT_LE(falling(), 1);
}

TEST(FlowingGas, WarmGasLiftsByTheWeightOfTheAirThatItDisplaces) {
  Options options = rubber_ball();
  options.symmetry.clear();
  options.prism.inertia = true;
  options.prism.mass_damping = 0;
  options.force.gravity = {0, 0, -9.81};
  options.gas.buoyancy = true;
  options.chambers["air"].law = GasLaw::isothermal;
  options.chambers["air"].temperature = {{0, 500}};
  StaticBalloon balloon(round_ball(2), options);
  const double volume = balloon.volume();
  const double density = 101325 * options.gas.molar_mass / (gas_constant * 293.15);
  const double lift = density * (1 - 293.15 / 500) * volume * 9.81;
  const Eigen::Matrix3Xd forces = balloon.chambers().uneven_forces(balloon.chambers().initial_exchange(),
                                                                   balloon.state().position, options.force.gravity, 0);
  Eigen::Vector3d sum = forces.rowwise().sum();
  MPI_Allreduce(MPI_IN_PLACE, sum.data(), 3, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
  EXPECT_NEAR(sum.z(), lift, 1e-9 * lift);
  EXPECT_NEAR(sum.head<2>().norm(), 0, 1e-9 * lift);
  balloon.reach(1e-3);
  const double weight = 9.81 * balloon.mass();
  EXPECT_NEAR(balloon.momentum().z(), 1e-3 * (lift - weight), 1e-4 * 1e-3 * weight);
}

TEST(FlowingGas, WhatTheWallGivesTheGasTakes) {
  Options options = rubber_ball();
  options.symmetry.clear();
  options.prism.inertia = true;
  options.prism.mass_damping = 20;
  options.ablation.strength = 1e9;  // so that the wall has temperatures
  options.heat.initial_temperature = 300;
  options.heat.diffusivity = 0;
  options.gas.links["pump"] = pump("air", {{0, 0.1}});
  options.gas.links["pump"].temperature = 900;
  options.chambers["air"].law = GasLaw::adiabatic;
  options.chambers["air"].heat_transfer = 2000;
  StaticBalloon balloon(icosphere_mesh(1, 0.05), options);
  const BurningFields& fields = balloon.burning();
  const GasExchange& gas = *balloon.state().gas;
  const auto heat_of_wall = [&] {
    return balloon.sum(
        [&](PetscInt i) { return options.heat.capacity * fields.mass.data()[i] * fields.temperature.data()[i]; });
  };
  const double before = heat_of_wall();
  for (int step = 0; step < 50; ++step) {
    const AloneStep advanced = balloon.advance(5e-3);
    ASSERT_TRUE(advanced.converged) << advanced.reason;
    EXPECT_NEAR(heat_of_wall() - before, -gas.wall_heat[0], 1e-12 * before);
  }
  EXPECT_LT(gas.wall_heat[0], -1e-3 * before);
  double ledger[2] = {fields.heat_in, fields.heat_out};
  MPI_Allreduce(MPI_IN_PLACE, ledger, 2, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
  EXPECT_NEAR(ledger[0] - ledger[1], heat_of_wall() - before, 1e-12 * before);
}

TEST(FlowingGas, AJetDrivesABalloonByTheMomentumOfItsGas) {
  // Without weight and air: momentum grows with the integral of 2 C A dp, all but exact for small differences of
  // pressure.
  Options options = rubber_ball();
  options.symmetry.clear();
  options.prism.inertia = true;
  options.prism.mass_damping = 0;
  options.chambers["air"].law = GasLaw::isothermal;
  options.chambers["air"].hole_discharge = 0.6;
  options.gas.links["pump"] = pump("air", {{0, 0.3}, {0.1, 0.3}, {0.101, 0}});
  SurfaceMesh mesh = icosphere_mesh(2, 0.05);
  mesh.faces.pop_back();  // the hole
  StaticBalloon balloon(mesh, options);
  double impulse = 0;
  for (int step = 1; step <= 100; ++step) {
    const double area = balloon.chambers()
                            .walls(*balloon.state().gas, balloon.state().position, Eigen::Vector3d::Zero(), 0)
                            .hole_area[0];
    const double pressure = balloon.pressure();
    balloon.reach(1e-3 * step);
    impulse += 1e-3 * 2 * 0.6 * area * pressure;
  }
  EXPECT_GT(impulse, 1e-3);
  EXPECT_NEAR(balloon.momentum().norm(), impulse, 0.03 * impulse);
}

/// Takes the faces away whose middle is within a distance of a point.
SurfaceMesh with_hole(SurfaceMesh mesh, const Eigen::Vector3d& middle, double size) {
  const auto is_gone = [&](const std::vector<int>& face) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const int point : face) {
      sum += mesh.points[point] / 3;
    }
    return (sum - middle).norm() < size;
  };
  mesh.faces.erase(std::remove_if(mesh.faces.begin(), mesh.faces.end(), is_gone), mesh.faces.end());
  std::map<int, int> number_of;  // of the points that are left
  SurfaceMesh left;
  for (const std::vector<int>& face : mesh.faces) {
    left.faces.emplace_back();
    for (const int point : face) {
      const auto [found, is_new] = number_of.try_emplace(point, static_cast<int>(left.points.size()));
      if (is_new) {
        left.points.push_back(mesh.points[point]);
      }
      left.faces.back().push_back(found->second);
    }
  }
  return left;
}

/// The same with its mirror image in the plane z = 0, in which its boundary lies.
SurfaceMesh with_mirror_image(const SurfaceMesh& half) {
  SurfaceMesh whole = half;
  std::vector<int> image;
  for (const Eigen::Vector3d& point : half.points) {
    const bool is_in_plane = std::abs(point.z()) < 1e-12;
    image.push_back(is_in_plane ? static_cast<int>(image.size()) : static_cast<int>(whole.points.size()));
    if (!is_in_plane) {
      whole.points.emplace_back(point.x(), point.y(), -point.z());
    }
  }
  for (const std::vector<int>& face : half.faces) {
    const auto of = [&](std::size_t k) { return image[face[k]]; };
    whole.faces.push_back({of(0), of(2), of(1)});
  }
  return whole;
}

TEST(FlowingGas, AHoleThatASymmetryPlaneCutsIsHalfAHole) {
  // A ball with holes at both poles and one on the equator, and its upper half with the plane of the equator.
  Options options = rubber_ball();
  options.symmetry.clear();
  options.prism.inertia = true;
  options.prism.snes_rtol = 1e-11;
  options.prism.ksp_rtol = 1e-10;
  options.chambers["air"].law = GasLaw::adiabatic;
  options.chambers["air"].hole_discharge = 0.6;
  options.gas.links["pump"] = pump("air", {{0, 0.4}});
  Options of_half = options;
  of_half.symmetry["equator"].normal = {0, 0, 1};
  of_half.gas.links["pump"].flow = {{0, 0.2}};
  const SurfaceMesh mesh = with_hole(with_hole(dome_mesh(2, 0.05), {0, 0, 0.05}, 0.01), {0.05, 0, 0}, 0.012);
  StaticBalloon whole(with_mirror_image(mesh), options);
  StaticBalloon half(mesh, of_half);
  EXPECT_NEAR(half.chambers().initial_volume(0), whole.chambers().initial_volume(0) / 2, 1e-12 * 5e-4);
  const auto hole_area = [](const StaticBalloon& balloon) {
    return balloon.chambers()
        .walls(*balloon.state().gas, balloon.state().position, Eigen::Vector3d::Zero(), 0)
        .hole_area[0];
  };
  EXPECT_NEAR(hole_area(half), hole_area(whole) / 2, 1e-12 * hole_area(whole));
  for (int step = 1; step <= 20; ++step) {
    whole.reach(1e-3 * step);
    half.reach(1e-3 * step);
  }
  EXPECT_GT(whole.pressure(), 50);
  EXPECT_NEAR(half.pressure(), whole.pressure(), 1e-8 * whole.pressure());
  EXPECT_NEAR(half.volume(), whole.volume() / 2, 1e-10 * whole.volume());
  const double momentum = whole.momentum().x();
  EXPECT_LT(momentum, -1e-5);
  EXPECT_NEAR(half.momentum().x(), momentum / 2, 1e-6 * std::abs(momentum));
}

TEST(FlowingGas, ByGeneralizedAlphaItFlowsAsByImplicitEuler) {
  // A ball that is pumped up and rings while gas leaves it by a hole: amounts and energy balance, and both integrators
  // lead to the same end where steps are short.
  const auto end = [](TimeScheme scheme, double h) {
    Options options = rubber_ball();
    options.symmetry.clear();
    options.prism.inertia = true;
    options.prism.mass_damping = 5;
    options.time.scheme = scheme;
    ChamberOptions& air = options.chambers["air"];
    air.law = GasLaw::adiabatic;
    air.hole_discharge = 0.6;
    air.heat_transfer = 20;
    air.wall_temperature = 350;
    options.gas.links["pump"] = pump("air", {{0, 0.4}});
    SurfaceMesh mesh = icosphere_mesh(1, 0.05);
    mesh.faces.pop_back();
    StaticBalloon balloon(mesh, options);
    const GasExchange first = *balloon.state().gas;
    const Chambers& chambers = balloon.chambers();
    const auto gas = [&] {
      return chambers.states(*balloon.state().gas, chambers.volumes(balloon.state().position), balloon.state().time)[0];
    };
    const GasState before = gas();
    for (int step = 1; step <= std::lround(0.1 / h); ++step) {
      balloon.reach(h * step);
    }
    const GasExchange& now = *balloon.state().gas;
    EXPECT_NEAR(gas().amount, before.amount + now.link_amount[0] - now.leak_amount[0], 1e-13 * before.amount);
    const double capacity = chambers.heat_capacity(0);
    EXPECT_NEAR(capacity * (gas().amount * gas().temperature - before.amount * before.temperature),
                now.link_enthalpy[0] - now.leak_enthalpy[0] + now.wall_heat[0] - now.work[0],
                1e-11 * capacity * before.amount * before.temperature);
    EXPECT_NEAR(now.link_amount[0], 0.04, 1e-12);
    return std::pair(balloon.volume(), now.leak_amount[0]);
  };
  const auto [volume, leak] = end(TimeScheme::generalized_alpha, 0.5e-3);
  const auto [volume_of_long, leak_of_long] = end(TimeScheme::generalized_alpha, 1e-3);
  const auto [volume_by_euler, leak_by_euler] = end(TimeScheme::implicit_euler, 0.25e-3);
  EXPECT_NEAR(volume_of_long, volume, 0.01 * volume);
  EXPECT_NEAR(leak_of_long, leak, 0.01 * leak);
  EXPECT_NEAR(volume_by_euler, volume, 0.01 * volume);
  EXPECT_NEAR(leak_by_euler, leak, 0.01 * leak);
}

}  // namespace
}  // namespace pellicle::flowing_gas_test
