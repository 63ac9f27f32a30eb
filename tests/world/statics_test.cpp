// Balloons and sheets in equilibrium: with given loads, and along the path of equilibria beyond limit points, where the
// loads' time decreases.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "geometry/pi.h"
#include "meshing/closed_shapes.h"
#include "tests/io/files.h"
#include "tests/support/grid_mesh.h"
#include "tests/support/print_once.h"
#include "tests/support/sphere_formulas.h"
#include "tests/world/static_balloon.h"

namespace pellicle::statics_test {
namespace {

constexpr double radius = 0.1;      // R [m]
constexpr double thickness = 3e-4;  // h [m]
constexpr double c1 = 2e5;          // [Pa]

/// A sphere of Mooney-Rivlin rubber with c2/c1 = 0.1 under a pressure that grows to 3 kPa in a second.
Options sphere_options() {
  Options options;
  options.chain = ChainKind::inflate;
  options.time.scheme = TimeScheme::statics;
  options.force.gravity.setZero();
  options.wall.thickness = thickness;
  options.wall.material.law = "mooney_rivlin";
  options.wall.material.c1 = c1;
  options.wall.material.c2 = 0.1 * c1;
  options.chambers["gas"].law = "pressure";
  options.chambers["gas"].pressure = {{0, 0}, {1, 3000}};
  return options;
}

TEST(Statics, EveryStepEndsInEquilibriumWhateverTheDamping) {
  const Options options = sphere_options();
  StaticBalloon one(icosphere_mesh(3, radius), options);
  one.reach(0.5);
  StaticBalloon several(icosphere_mesh(3, radius), options);
  for (const double time : {0.01, 0.2, 0.5}) {
    several.reach(time);
  }
  Material material = one.elements().wall().materials[0];
  const double stretch = std::cbrt(one.volume() / one.chambers().initial_volume(0));
  EXPECT_NEAR(sphere_pressure(material, thickness / radius, stretch), 1500, 0.005 * 1500);
  EXPECT_NEAR(several.volume(), one.volume(), 1e-6 * one.volume());
}

struct Place {
  double stretch;
  double load;  ///< p R/(h c1)
};

/// The highest or lowest point of the parabola through the places round the highest or lowest of the values.
Place extreme(const std::vector<Place>& path, std::size_t from, std::size_t to, double sign) {
  std::size_t best = from;
  for (std::size_t k = from; k < to; ++k) {
    best = sign * path[k].load > sign * path[best].load ? k : best;
  }
  const auto& [a, b, c] = std::tie(path[best - 1], path[best], path[best + 1]);
  const double left = (b.load - a.load) / (b.stretch - a.stretch);
  const double right = (c.load - b.load) / (c.stretch - b.stretch);
  const double curvature = (right - left) / (c.stretch - a.stretch);
  const double slope = left + curvature * (b.stretch - a.stretch);
  return {b.stretch - slope / (2 * curvature), b.load - slope * slope / (4 * curvature)};
}

TEST(ArcLength, FollowsASphereThroughBothOfItsLimitPoints) {
  Options options = sphere_options();
  options.time.arc_length = radius;
  StaticBalloon balloon(icosphere_mesh(3, radius), options);
  std::vector<Place> path{{1, 0}};
  for (int step = 1; step <= 30; ++step) {
    balloon.reach(0.1 * step);
    const double load_time = *balloon.state().load_time;
    EXPECT_NEAR(balloon.pressure(), 3000 * load_time, 1e-9 * 3000);
    path.push_back({std::cbrt(balloon.volume() / balloon.chambers().initial_volume(0)),
                    balloon.pressure() * radius / (thickness * c1)});
    EXPECT_NEAR(path.back().stretch - path[path.size() - 2].stretch, 0.1, 1e-3) << "all radial";
  }
  EXPECT_GT(path.back().stretch, 3.9);
  const Place highest = extreme(path, 1, 15, 1);
  const Place lowest = extreme(path, 10, path.size() - 1, -1);
  print_once(
      "highest %.5f at %.4f (2.98124 at 1.4761), lowest %.5f at %.4f (2.52724 at 3.1427); %.1f iterations a step\n",
      highest.load, highest.stretch, lowest.load, lowest.stretch, balloon.newton_iterations / 30.0);
  EXPECT_NEAR(highest.load, 2.98124, 0.005 * 2.98124);
  EXPECT_NEAR(highest.stretch, 1.4761, 0.01 * 1.4761);
  EXPECT_NEAR(lowest.load, 2.52724, 0.005 * 2.52724);
  EXPECT_NEAR(lowest.stretch, 3.1427, 0.01 * 3.1427);
  EXPECT_LT(balloon.newton_iterations, 4 * 30);
  const Material material = balloon.elements().wall().materials[0];
  for (std::size_t k = 1; k < path.size(); ++k) {
    const double expected = sphere_pressure(material, thickness / radius, path[k].stretch) * radius / (thickness * c1);
    EXPECT_NEAR(path[k].load, expected, 0.006 * expected) << "stretch " << path[k].stretch;
  }
}

// A flat pyramid on a rim that is constrained, pushed down at its top: it snaps through. Its height z is all that
// moves; by the slant height s(z) of its sides, whose strain is E = (s^2/s0^2 - 1)/2,
//
//   U = 6 A h (lambda/2 + mu) E^2, force -dU/dz.
TEST(ArcLength, FollowsAPyramidThatSnapsThrough) {
  constexpr double side = 0.1;     // of the rim [m]
  constexpr double height = 0.02;  // [m]
  constexpr double lambda = 3e5;
  constexpr double mu = 4e5;
  SurfaceMesh mesh;
  mesh.points = {{0, 0, height}};
  for (int k = 0; k < 6; ++k) {
    mesh.points.emplace_back(side * std::cos(k * pi / 3), side * std::sin(k * pi / 3), 0);
    mesh.faces.push_back({0, 1 + k, 1 + (k + 1) % 6});
  }
  Options options;
  options.chain = ChainKind::inflate;
  options.time.scheme = TimeScheme::statics;
  options.force.gravity.setZero();
  options.wall.thickness = thickness;
  options.wall.thickness_rule = "fixed";
  options.wall.bending = "none";  // the formula is of membranes
  options.wall.material.law = "st_venant_kirchhoff";
  options.wall.material.lambda = lambda;
  options.wall.material.mu = mu;
  options.pins["rim"].box = {-1, -1, -0.001, 1, 1, 0.001};
  options.forces["push"].vertices = {0};
  options.forces["push"].force = {{-10, 0, 0, 10}, {10, 0, 0, -10}};  // 1 N/s, upwards before time 0
  options.prism.snes_rtol = 1e-10;
  options.time.arc_length = 1e-3;  // of all vertices, of whose mass the top has a third
  StaticBalloon balloon(mesh, options);

  const double apothem = std::sqrt(3) / 2 * side;
  const double slant = std::hypot(apothem, height);
  const auto force = [&](double z) {
    const double strain = ((apothem * apothem + z * z) / (slant * slant) - 1) / 2;
    return -6 * (side * slant / 2) * thickness * (lambda + 2 * mu) * strain * z / (slant * slant);
  };
  const double strongest = force(height / std::sqrt(3));
  double before = height;
  double highest = 0;
  double lowest = 0;
  for (int step = 1; step <= 28; ++step) {
    balloon.reach(step);
    const double z = balloon.height_of(0);
    EXPECT_NEAR(before - z, 1e-3 * std::sqrt(3), 1e-9);
    before = z;
    EXPECT_NEAR(*balloon.state().load_time, force(z), 1e-6 * strongest) << "at a height of " << z;
    highest = std::max(highest, z > 0 ? *balloon.state().load_time : 0);
    lowest = std::min(lowest, *balloon.state().load_time);
  }
  EXPECT_LT(before, -1.3 * height);
  EXPECT_NEAR(highest, strongest, 0.01 * strongest);
  EXPECT_NEAR(lowest, -strongest, 0.01 * strongest);
}

TEST(ArcLength, SaysWhereTheLoadsEnd) {
  Options options = sphere_options();
  options.time.arc_length = radius;
  options.chambers["gas"].pressure = {{0, 0}, {1, 1000}};
  StaticBalloon balloon(icosphere_mesh(1, radius), options);
  AloneStep result;
  for (int step = 1; step <= 30 && result.converged; ++step) {
    result = balloon.step_to(balloon.state().time + 0.05);
  }
  EXPECT_FALSE(result.converged);
  EXPECT_NE(result.reason.find("the loads do not change any more"), std::string::npos) << result.reason;
}

TEST(ArcLength, ActsWithStaticsAlone) {
  for (const TimeScheme scheme : {TimeScheme::implicit_euler, TimeScheme::generalized_alpha}) {
    Options options = sphere_options();
    options.time.scheme = scheme;
    StaticBalloon plain(icosphere_mesh(1, radius), options);
    options.time.arc_length = radius;
    StaticBalloon asked(icosphere_mesh(1, radius), options);
    plain.go_to(0.02, 0.005);
    asked.go_to(0.02, 0.005);
    EXPECT_GT(plain.volume(), 1.001 * plain.chambers().initial_volume(0));
    EXPECT_EQ(asked.volume(), plain.volume());
  }
}

TEST(ArcLength, SaysWhatItDoesNotGoWith) {
  ObjectOptions object("");
  object.options = sphere_options();
  object.options.chain = ChainKind::inflate;
  object.options.time.arc_length = radius;
  object.options.force.air.density = 1;
  EXPECT_EQ(error_text([&] { object.table.check_exclusions(); }),
            "time.arc_length: does not go with force.air_density, expected none");
}

// In a single step, by the formula of a strip: its tension at x is the weight below, rho g (L - x).
TEST(SheetAtRest, HangsByItsWeight) {
  constexpr double g = 9.81;
  constexpr double tensile = 500;  // [N/m]
  for (const int cells : {10, 20}) {
    Options options;
    options.dynamics = Dynamics::elastic;
    options.time.scheme = TimeScheme::statics;
    options.force.gravity = {g, 0, 0};
    options.sheet.areal_density = 1;
    options.material.tensile_stiffness = tensile;
    options.material.bending_stiffness = 0.1;
    options.elastic.newton_tolerance = 1e-8;
    const SurfaceMesh mesh = grid_mesh(cells, cells / 5, 1.0 / cells);
    for (std::size_t point = 0; point < mesh.points.size(); ++point) {
      if (mesh.points[point].x() < 1e-9) {
        options.pins["edge"].vertices.push_back(static_cast<int>(point));
      }
    }
    Alone sheet(mesh, options);
    State& state = sheet.state();
    for (const double h : {1.0, 0.01}) {
      const AloneStep step = sheet.advance(h);
      ASSERT_TRUE(step.converged) << step.reason;
      double end = 0;
      for (PetscInt i = 0; i < sheet.sheet().owned_corners; ++i) {
        end = std::max(end, state.position.vector(i).x());
      }
      MPI_Allreduce(MPI_IN_PLACE, &end, 1, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD);
      EXPECT_NEAR(end - 1, g / (2 * tensile), 0.02 * g / (2 * tensile)) << cells << " cells, step of " << h << " s";
      EXPECT_EQ(state.velocity.values().cwiseAbs().maxCoeff(), 0);
    }
    const double energy = sheet.figure("elastic_energy");
    EXPECT_NEAR(energy, of(state.work, Work::gravity) / 2, 0.02 * energy);
  }
}

// A sphere of springs under a pressure that grows. Stretched by l, its tension is K (l - 1)/l a length, and so
//
//   p = 2 K (l - 1)/(l^2 R),
//
// which is highest at l = 2, for a sheet of any springs alike.
TEST(SheetAtRest, FollowsASphereOfSpringsBeyondItsHighestPressure) {
  // Springs that are all equally stiff are not so on cells that differ: the sphere does not stay quite round.
  for (const auto& [dynamics, accuracy] : {std::pair("elastic", 0.005), std::pair("spring", 0.03)}) {
    Options options;
    options.dynamics = Choice<Dynamics>(dynamics);
    options.time.scheme = TimeScheme::statics;
    options.time.arc_length = radius;
    options.force.gravity.setZero();
    options.sheet.thickness = 0;  // The springs lie in the surface.
    options.material.tensile_stiffness = 100;
    options.material.bending_stiffness = 1e-6;
    options.elastic.newton_tolerance = 1e-8;
    options.spring.snes_rtol = 1e-8;
    options.chambers["gas"].law = "pressure";
    options.chambers["gas"].pressure = {{-1, -1e4}, {1, 1e4}};
    Alone sheet(quad_ellipsoid_mesh(3, {radius, radius, radius}), options);
    std::vector<Place> path{{1, 0}};
    const double undeformed = sheet.figure("gas_volume");
    double stiffness = 0;  // 2 K/R
    for (int step = 1; step <= 20; ++step) {
      const AloneStep result = sheet.advance(0.1);
      ASSERT_TRUE(result.converged) << dynamics << ": " << result.reason;
      const double pressure = sheet.state().pressure[0];
      EXPECT_NEAR(pressure, 1e4 * sheet.figure("load_time"), 1e-6 * pressure);
      const double stretch = std::cbrt(sheet.figure("gas_volume") / undeformed);
      if (step > 1) {
        EXPECT_NEAR(stretch - path.back().stretch, 0.1, 0.4 * accuracy) << dynamics << ": nearly all radial";
      }
      path.push_back({stretch, pressure});
      stiffness = step == 1 ? pressure * stretch * stretch / (stretch - 1) : stiffness;
      const double expected = stiffness * (stretch - 1) / (stretch * stretch);
      EXPECT_NEAR(pressure, expected, accuracy * expected) << dynamics << ", stretch " << stretch;
    }
    const Place highest = extreme(path, 5, path.size() - 1, 1);
    print_once("%s: highest %.5g Pa at %.4f (%.5g at 2)\n", dynamics, highest.load, highest.stretch, stiffness / 4);
    EXPECT_NEAR(highest.stretch, 2, 0.02);
    EXPECT_LT(path.back().load, 0.95 * highest.load);
  }
}

// What is pinned moves with the time of the loads: a strip is drawn out evenly, each particle by its share of the way.
TEST(SheetAtRest, IsDrawnOutByPinsWhoseTimeFollows) {
  constexpr double speed = 0.01;  // of the end, by the time of the loads [m/s]
  Options options;
  options.dynamics = Dynamics::elastic;
  options.time.scheme = TimeScheme::statics;
  options.time.arc_length = 1e-3;
  options.force.gravity.setZero();
  options.elastic.newton_tolerance = 1e-10;
  const SurfaceMesh mesh = grid_mesh(10, 1, 0.1);
  for (std::size_t point = 0; point < mesh.points.size(); ++point) {
    const double x = mesh.points[point].x();
    if (x < 1e-9 || x > 1 - 1e-9) {
      options.pins[x < 0.5 ? "start" : "end"].vertices.push_back(static_cast<int>(point));
    }
  }
  options.pins["end"].path = {{0, 0, 0, 0}, {10, 10 * speed, 0, 0}};
  Alone sheet(mesh, options);
  const Sheet& surface = sheet.sheet();
  const auto squared_share = [&](PetscInt i) {  // of a free particle
    const double x = surface.rest(0, i);
    return x < 1 - 1e-9 ? surface.initial_mass[i] * x * x : 0;
  };
  const double share = std::sqrt(sheet.sum(squared_share) / sheet.mass());
  double before = 0;
  for (int step = 1; step <= 3; ++step) {
    const AloneStep result = sheet.advance(1);
    ASSERT_TRUE(result.converged) << result.reason;
    const double time = sheet.figure("load_time");
    if (step > 1) {  // The first one goes by where the loads push, not yet by the path.
      EXPECT_NEAR(time - before, 1e-3 / (share * speed), 0.01 * (time - before));
    }
    before = time;
  }
}

}  // namespace
}  // namespace pellicle::statics_test
