#include "contact/body_heat.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "geometry/pi.h"
#include "meshing/triangulation.h"
#include "parallel/collective.h"
#include "tests/heat/sheets.h"

namespace pellicle {
namespace {

using Eigen::Vector3d;

constexpr double transfer = 500;  // [W/(m^2 K)]
constexpr double resting_gap = 1e-3;
constexpr double capacity = 1000;  // [J/(kg K)]

/// A hot body that stays where it is. @param turn rotation vector
Body hot_body(Shape shape, const Vector3d& place, const Vector3d& turn = Vector3d::Zero(), double reach = 5e-3) {
  Body body;
  body.shape = std::move(shape);
  body.motion.start = {rotation_matrix(turn), place};
  body.temperature = 800;
  body.heat_transfer = transfer;
  body.heat_reach = reach;
  return body;
}

/// What body_conductance asks for, of a surface as it stands.
struct Standing {
  explicit Standing(const Surface& surface)
      : positions(rest_positions(surface)), mass(initial_masses(surface)), active(surface) {}
  BodyHeatInput input(double h = 0.01) const { return {positions, mass, active, 0, h, capacity, resting_gap}; }

  Field positions;
  Field mass;
  ActiveSet active;
};

/// The area that would take as much heat if it touched the body. Collective.
double touching_area(const Surface& surface, const Body& body, const BodyHeatInput& input) {
  return sum_over_ranks(PETSC_COMM_WORLD, body_conductance(surface, body, input).sum()) / transfer;
}
double touching_area(const Surface& surface, const Body& body) {
  return touching_area(surface, body, Standing(surface).input());
}

SurfaceMesh centred(SurfaceMesh mesh) {
  Vector3d sum = Vector3d::Zero();
  for (const Vector3d& point : mesh.points) {
    sum += point;
  }
  for (Vector3d& point : mesh.points) {
    point -= sum / static_cast<double>(mesh.points.size());
  }
  return mesh;
}
/// A square of n x n cells and side 0.4 round the origin, in the plane z = 0.
SurfaceMesh square(int n) { return centred(grid_mesh(n, n, 0.4 / n)); }
/// Its cells become rhomboids, and then have points that are moved in the plane.
SurfaceMesh skew_square(int n, double size) {
  SurfaceMesh mesh = square(n);
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    Vector3d& x = mesh.points[i];
    const double edge = 0.4 / n;
    const Vector3d phase = 40 * x / edge;
    x += Vector3d(0.4 * x.y() + size * edge * std::sin(phase.x() + 2 * phase.y()),
                  size * edge * std::cos(3 * phase.x() - phase.y()), 0);
  }
  return mesh;
}
/// Every cell of the square is three quads: those of two triangles, whose quads are not alike.
SurfaceMesh kites(int n) {
  const SurfaceMesh triangles = triangulated(square(n));
  SurfaceMesh mesh;
  mesh.points = triangles.points;
  std::map<std::pair<int, int>, int> middles;
  const auto middle = [&](int a, int b) {
    const auto [found, is_new] = middles.try_emplace(std::minmax(a, b), static_cast<int>(mesh.points.size()));
    if (is_new) {
      mesh.points.push_back((mesh.points[a] + mesh.points[b]) / 2);
    }
    return found->second;
  };
  for (const std::vector<int>& face : triangles.faces) {
    Vector3d centre = Vector3d::Zero();
    for (const int point : face) {
      centre += mesh.points[point] / 3;
    }
    const std::array<int, 3> sides{middle(face[0], face[1]), middle(face[1], face[2]), middle(face[2], face[0])};
    const auto last = static_cast<int>(mesh.points.size());
    mesh.points.push_back(centre);
    for (std::size_t k = 0; k < 3; ++k) {
      mesh.faces.push_back({face[k], sides[k], last, sides[(k + 2) % 3]});
    }
  }
  return mesh;
}

/// Integral of the weight, times s, over s from 0 to 1; without s it is a half.
constexpr double first_moment = 1.0 / 7;

/// Of a flat sheet, whose plane passes a ball at the distance d from its middle: with D dD = rho drho round it.
double area_under_ball(double radius, double d, double reach = 5e-3) {
  const double touching = radius + resting_gap;
  return pi * (touching * touching - d * d) + 2 * pi * reach * (touching / 2 + reach * first_moment);
}

// Also where it rests in the zone of contact, or in the body by rounding, counts for nothing.
TEST(BodyHeat, AFlatSurfaceOnAPlaneTakesHeatByItsArea) {
  std::vector<SurfaceMesh> meshes{square(3), square(8), skew_square(5, 0), skew_square(6, 0.2), kites(4)};
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    const Sheet sheet = shell_of(meshes[m], 0);
    const Membrane membrane = membrane_of(triangulated(meshes[m]));
    for (const Surface* surface : {static_cast<const Surface*>(&sheet), static_cast<const Surface*>(&membrane)}) {
      const Standing standing(*surface);
      for (const double gap : {resting_gap, 0.3 * resting_gap, 0.0, -1e-4}) {
        const Body plane = hot_body(HalfSpace{}, {0, 0, -gap});
        const Eigen::VectorXd conductance = body_conductance(*surface, plane, standing.input());
        for (PetscInt i = 0; i < surface->particles.owned; ++i) {
          const double mass = surface->initial_mass[i];
          ASSERT_NEAR(conductance[i], transfer * mass / test_density, 1e-12) << "mesh " << m << ", gap " << gap;
        }
      }
    }
    // Heat of an exponential approach, the same everywhere.
    const Standing standing(sheet);
    Field temperature = field_of(sheet, [](const Vector3d&) { return 300.0; });
    const double h = 0.05;
    const double area =
        sum_over_ranks(PETSC_COMM_WORLD, standing.mass.values().leftCols(sheet.particles.owned).sum()) / test_density;
    const double rise = 500 * (1 - std::exp(-transfer * h / (test_density * capacity)));
    const BodyHeat heat =
        exchange_with_bodies(temperature, sheet, {hot_body(HalfSpace{}, {0, 0, 0})}, standing.input(h));
    EXPECT_NEAR(sum_over_ranks(PETSC_COMM_WORLD, heat.gained), test_density * area * capacity * rise, 1e-10);
    EXPECT_EQ(heat.lost, 0);
    EXPECT_NEAR(max_over_ranks(PETSC_COMM_WORLD, temperature.values().maxCoeff()), 300 + rise, 1e-10);
    EXPECT_NEAR(-max_over_ranks(PETSC_COMM_WORLD, -temperature.values().minCoeff()), 300 + rise, 1e-10);
  }
}

TEST(BodyHeat, BeyondContactAPlaneGivesByTheWeightOfTheGap) {
  const Sheet sheet = shell_of(square(4), 0);
  for (const double s : {0.25, 0.5, 0.75, 1.0, 2.0}) {
    const double weight = s < 1 ? 1 - std::pow(s, 3) * (10 - 15 * s + 6 * s * s) : 0;
    Body plane = hot_body(HalfSpace{}, {0, 0, -0.02 - resting_gap - s * 5e-3});
    plane.margin = 0.02;
    EXPECT_NEAR(touching_area(sheet, plane), 0.16 * weight, 1e-12) << s;
  }
}

// Balls from ten cells to a tenth of a cell, which may lie anywhere over a cell.
TEST(BodyHeat, ABallOverAFlatSurfaceGivesTheIntegralOfTheWeightOnAnyMesh) {
  std::vector<SurfaceMesh> meshes{square(10), square(40), skew_square(20, 0.2), kites(10)};
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    const Sheet sheet = shell_of(meshes[m], 0);
    const Membrane membrane = membrane_of(triangulated(meshes[m]));
    for (const Surface* surface : {static_cast<const Surface*>(&sheet), static_cast<const Surface*>(&membrane)}) {
      for (const double radius : {0.1, 0.02, 5e-3, 1e-3}) {
        for (const double gap : {-0.3 * radius, 0.0, resting_gap}) {
          const double d = radius + gap;
          const Body ball = hot_body(Sphere{radius}, {0.013, -0.022, d});
          const double expected = area_under_ball(radius, d);
          EXPECT_NEAR(touching_area(*surface, ball), expected, 2e-3 * expected)
              << "mesh " << m << ", radius " << radius << ", gap " << gap;
        }
      }
    }
  }
}

// A reach far below the cell, and below the ball.
TEST(BodyHeat, ANarrowReachGivesTheAreaThatTouches) {
  const Sheet sheet = shell_of(square(10), 0);
  for (const double reach : {1e-3, 1e-4, 1e-5}) {
    const double expected = area_under_ball(0.05, 0.045, reach);
    EXPECT_NEAR(touching_area(sheet, hot_body(Sphere{0.05}, {0.013, -0.022, 0.045}, Vector3d::Zero(), reach)), expected,
                3e-3 * expected)
        << reach;
  }
}

/// A box as a mesh of twelve triangles.
std::shared_ptr<const ClosedMesh> box_mesh(const Vector3d& half) {
  std::vector<Vector3d> points;
  for (int i = 0; i < 8; ++i) {
    points.emplace_back((i & 1 ? 1 : -1) * half[0], (i & 2 ? 1 : -1) * half[1], (i & 4 ? 1 : -1) * half[2]);
  }
  return std::make_shared<const ClosedMesh>(points, Triangles{{0, 2, 3},
                                                              {0, 3, 1},
                                                              {4, 5, 7},
                                                              {4, 7, 6},
                                                              {0, 1, 5},
                                                              {0, 5, 4},
                                                              {2, 6, 7},
                                                              {2, 7, 3},
                                                              {0, 4, 6},
                                                              {0, 6, 2},
                                                              {1, 3, 7},
                                                              {1, 7, 5}});
}

// Beyond the edges of the lower face there is a strip, and at its corners a part of a disc.
TEST(BodyHeat, ABoxAndItsMeshGiveByTheFaceAndWhatIsBesideIt) {
  const Vector3d half(0.05, 0.03, 0.02);
  const double touching = resting_gap;
  const double strip = touching + 5e-3 / 2;
  const double expected = 4 * half.x() * half.y() + 4 * (half.x() + half.y()) * strip + pi * touching * touching +
                          2 * pi * 5e-3 * (touching / 2 + 5e-3 * first_moment);
  for (const int n : {5, 20, 80}) {
    const Sheet sheet = shell_of(square(n), 0);
    EXPECT_NEAR(touching_area(sheet, hot_body(Box{half}, {0.013, -0.022, half.z()}, {0, 0, 0.3})), expected,
                2e-3 * expected)
        << n;
    if (n < 80) {
      EXPECT_NEAR(touching_area(sheet, hot_body(box_mesh(half), {0.013, -0.022, half.z()}, {0, 0, 0.3})), expected,
                  5e-3 * expected)
          << n;
    }
  }
}

// Standing and lying, near enough to touch, and thinner than a cell.
TEST(BodyHeat, EveryBodyGivesTheSameOnAnyMesh) {
  const std::vector<std::pair<Shape, double>> bodies{{Capsule{0.01, 0.05}, 0.01},
                                                     {Cylinder{0.03, 0.05}, 0.03},
                                                     {Ring{0.05, 4e-3}, 0.054},
                                                     {Capsule{1e-3, 0.08}, 1e-3},
                                                     {box_mesh({0.02, 1e-3, 0.04}), 1e-3}};
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const auto& [shape, height] = bodies[b];
    const Body body = hot_body(shape, {0.013, -0.022, height}, pi / 2 * Vector3d::UnitX());
    const double fine = touching_area(shell_of(square(64), 0), body);
    ASSERT_GT(fine, 1e-5);
    for (const SurfaceMesh& mesh : {square(8), square(20), skew_square(20, 0.2)}) {
      EXPECT_NEAR(touching_area(shell_of(mesh, 0), body), fine, 0.01 * fine) << b << ", " << mesh.faces.size();
    }
  }
}

// The lattice points are 2 cm above the corners, at a plane above as near as these are at one below.
TEST(BodyHeat, ASheetOfTwoLayersTakesHeatOnEitherSide) {
  const Sheet sheet = shell_of(skew_square(6, 0.2), 0.02);
  const double area =
      sum_over_ranks(PETSC_COMM_WORLD, Standing(sheet).mass.values().leftCols(sheet.particles.owned).sum()) /
      test_density;
  EXPECT_NEAR(touching_area(sheet, hot_body(HalfSpace{}, {0, 0, 0})), area, 1e-12);
  EXPECT_NEAR(touching_area(sheet, hot_body(HalfSpace{}, {0, 0, 0.02}, pi * Vector3d::UnitX())), area, 1e-12);
  EXPECT_EQ(touching_area(sheet, hot_body(HalfSpace{}, {0, 0, 0.03}, pi * Vector3d::UnitX())), 0);
}

// Half of it has burnt, a cell in part.
TEST(BodyHeat, DeadTrianglesTakeNoneAndTheRestOfACellGetsEvenlyHotter) {
  const Sheet sheet = shell_of(square(10), 0);
  Standing standing(sheet);
  standing.active =
      without(sheet, [](const Vector3d& x) { return x.x() < 0 || (x.x() < 0.01 && x.y() > 0 && x.y() < 0.04); });
  const Body plane = hot_body(HalfSpace{}, {0, 0, 0});
  EXPECT_NEAR(touching_area(sheet, plane, standing.input()), 0.08 - 0.04 * 0.04 / 4, 1e-14);
  const Eigen::VectorXd conductance = body_conductance(sheet, plane, standing.input());
  for (PetscInt i = 0; i < sheet.particles.owned; ++i) {
    EXPECT_LE(conductance[i], transfer * sheet.initial_mass[i] / test_density * (1 + 1e-12));
  }
}

// A cell of triangles that are not alike has lost the one between its first two corners: these have one left, the
// others two, and corners count by the number of their triangles.
TEST(BodyHeat, CornersOfAnUnevenCellTakeByTheNumberOfTheirTriangles) {
  SurfaceMesh mesh;
  mesh.points = {{0, 0, 0}, {0.3, 0, 0}, {0.25, 0.2, 0}, {0, 0.1, 0}};
  mesh.faces = {{0, 1, 2, 3}};
  const Sheet sheet = shell_of(mesh, 0);
  Standing standing(sheet);
  double area = 0;
  for (std::size_t t = 0; t < sheet.triangles.size(); ++t) {
    const auto [e12, e13] = edges_of(sheet.rest.data(), sheet.triangles[t]);
    standing.active.triangles[t] = t != 0;
    area += t != 0 ? e12.cross(e13).norm() / 2 : 0;
  }
  const Eigen::VectorXd conductance =
      body_conductance(sheet, hot_body(HalfSpace{}, {0, 0, 0}), standing.input()) / transfer;
  for (PetscInt i = 0; i < sheet.particles.owned && !sheet.cells.empty(); ++i) {
    const PetscInt id = sheet.persistent_id[i];
    const double fraction = sheet.is_lattice[i] ? 0.5 : 0.5 * (id < 2 ? 1 : 2) / 6;
    EXPECT_NEAR(conductance[i], fraction * area, 1e-14) << id;
  }
}

TEST(BodyHeat, AColdBodyTakesWhatTheSurfaceLosesAndNoneIsColderThanIt) {
  const Sheet sheet = shell_of(square(7), 0);
  const Standing standing(sheet);
  Field temperature = field_of(sheet, [](const Vector3d& x) { return 300 + 100 * std::sin(20 * x.x() + 3 * x.y()); });
  Field before(sheet.particles, 1);
  before.values() = temperature.values();
  Body ball = hot_body(Sphere{0.1}, {0, 0, 0.1});
  ball.temperature = 250;
  BodyHeat all;
  for (const double h : {0.01, 0.1, 1e6}) {
    const BodyHeat heat = exchange_with_bodies(temperature, sheet, {ball}, standing.input(h));
    all.gained += heat.gained;
    all.lost += heat.lost;
  }
  double change = 0;
  double least = 1e9;
  for (PetscInt i = 0; i < sheet.particles.owned; ++i) {
    change += capacity * standing.mass.data()[i] * (temperature.data()[i] - before.data()[i]);
    least = std::min(least, std::max(temperature.data()[i], std::min(250.0, before.data()[i])));
  }
  EXPECT_NEAR(sum_over_ranks(PETSC_COMM_WORLD, change), sum_over_ranks(PETSC_COMM_WORLD, all.gained - all.lost), 1e-10);
  EXPECT_GE(least, 200);
  EXPECT_GT(sum_over_ranks(PETSC_COMM_WORLD, all.lost), 1);
}

}  // namespace
}  // namespace pellicle
