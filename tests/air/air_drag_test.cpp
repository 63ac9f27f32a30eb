#include "air/air_drag.h"

#include <gtest/gtest.h>

#include <cmath>

#include "geometry/principal_axes.h"
#include "meshing/closed_shapes.h"
#include "surface/active_set.h"
#include "surface/membrane.h"
#include "surface/shell.h"
#include "tests/support/grid_mesh.h"

namespace pellicle {
namespace {

using Eigen::Vector3d;

constexpr double width = 0.8;
constexpr double height = 0.6;

/// A flat sheet of 8 x 6 cells and air that blows at it.
class AirDragTest : public ::testing::Test {
 protected:
  AirDragTest() {
    air.density = 1.2;
    air.drag = 1.1;
    air.skin_drag = 0.02;
    position.values() = sheet.rest;
  }

  AirDrag begun(double time_end = 0) {
    AirDrag drag(sheet, air);
    drag.begin_step(position, velocity, sheet.initial_mass, active, time_end);
    return drag;
  }

  /// The sum of b - D v over all particles. Collective.
  Vector3d total(const AirDrag& drag) const {
    Vector3d sum = Vector3d::Zero();
    for (PetscInt i = 0; i < sheet.particles.owned; ++i) {
      sum += drag.push(i) - drag.resistance(i) * velocity.vector(i);
    }
    MPI_Allreduce(MPI_IN_PLACE, sum.data(), 3, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
    return sum;
  }

  Sheet sheet = make_sheet(PETSC_COMM_WORLD, grid_mesh(8, 6, 0.1), SheetOptions());
  AirOptions air;
  Field position{sheet.particles, 3};
  Field velocity{sheet.particles, 3};
  const std::vector<bool>* active = nullptr;
};

TEST_F(AirDragTest, HeldSheetTakesTheForceOfTheWind) {
  air.wind.velocity = {{0, 3, 0, -4}};
  const double stream = air.density / 2 * width * height;  // over the square of a speed
  const Vector3d expected(stream * air.skin_drag * 9, 0, -stream * air.drag * 16);
  EXPECT_LE((total(begun()) - expected).norm(), 1e-12 * expected.norm());
}

TEST_F(AirDragTest, PointsHaveTheirShares) {
  air.wind.velocity = {{0, 0, 0, -4}};
  const AirDrag drag = begun();
  for (PetscInt i = 0; i < sheet.particles.owned; ++i) {
    const double fraction = sheet.initial_mass[i] / (SheetOptions().areal_density);
    EXPECT_NEAR(drag.push(i)[2], -air.density / 2 * air.drag * 16 * fraction, 1e-12);
  }
}

TEST_F(AirDragTest, LatticePointsWithoutMassLeaveItToTheCorners) {
  air.wind.velocity = {{0, 0, 0, -4}};
  const double expected = total(begun())[2];
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    if (sheet.is_lattice[i]) {
      sheet.initial_mass[i] = 0;
    }
  }
  const AirDrag drag = begun();
  EXPECT_NEAR(total(drag)[2], expected, 1e-12 * std::abs(expected));
  for (PetscInt i = sheet.owned_corners; i < sheet.particles.owned; ++i) {
    EXPECT_EQ(drag.push(i), Vector3d::Zero());
  }
}

TEST_F(AirDragTest, OnlyWhatMovesRelativeToTheAirIsDragged) {
  air.wind.velocity = {{0, 1, 0, -2}};
  velocity.values().colwise() = Vector3d(1, 0, -2);
  EXPECT_LE(total(begun()).norm(), 1e-14);
  velocity.values().colwise() = Vector3d(1, 0, -3);
  EXPECT_NEAR(total(begun())[2], air.density / 2 * air.drag * width * height, 1e-12);
}

TEST_F(AirDragTest, WhatHasBurntIsNotDragged) {
  air.wind.velocity = {{0, 0, 0, -4}};
  const double whole = total(begun())[2];
  std::vector<bool> half(sheet.triangles.size());
  for (std::size_t t = 0; t < half.size(); ++t) {
    half[t] = sheet.element_id[t / 4] % 2 == 0;
  }
  active = &half;
  EXPECT_NEAR(total(begun())[2], whole / 2, 1e-12 * std::abs(whole));
}

TEST_F(AirDragTest, LightSheetsAndLongStepsGoToTheWindAndNotBeyond) {
  air.wind.velocity = {{0, 3, 0, -4}};
  for (const double h : {1e-3, 1.0, 1e6}) {
    for (const double mass : {1e-9, 1.0}) {
      velocity.values().setZero();
      const AirDrag drag = begun();
      drag.accelerate(velocity, std::vector<double>(sheet.initial_mass.size(), mass), h);
      for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
        EXPECT_GT(velocity.vector(i)[0], 0);
        EXPECT_LE(velocity.vector(i)[0], 3 + 1e-9);
        EXPECT_LT(velocity.vector(i)[2], 0);
        EXPECT_GE(velocity.vector(i)[2], -4 - 1e-9);
      }
    }
  }
}

TEST_F(AirDragTest, DragTakesEnergyWhateverMoves) {
  velocity.values() = (31 * sheet.rest).array().sin();
  const AirDrag drag = begun();
  double before = 0;
  double after = 0;
  const Eigen::Matrix3Xd start = velocity.values();
  drag.accelerate(velocity, sheet.initial_mass, 0.5);
  for (PetscInt i = 0; i < sheet.particles.owned; ++i) {
    EXPECT_GE(principal_axes(drag.resistance(i)).values[0], -1e-15);
    const double mass = sheet.initial_mass[i];
    before += mass * start.col(i).squaredNorm();
    after += mass * velocity.vector(i).squaredNorm();
  }
  EXPECT_LT(after, before);
}

TEST(AirDrag, ClosedSurfacesAreDraggedOnAllSides) {
  // Each triangle by itself, on both sides alike: of a sphere C_n rho/2 u^2 times the integral of |cos|^3, pi R^2.
  const Membrane ball = make_membrane(PETSC_COMM_WORLD, icosphere_mesh(4, 0.5), SheetOptions());
  AirOptions air;
  air.density = 1.2;
  air.wind.velocity = {{0, 5, 0, 0}};
  Field position(ball.particles, 3);
  const Field velocity(ball.particles, 3);
  position.values() = ball.rest;
  AirDrag drag(ball, air);
  drag.begin_step(position, velocity, {}, nullptr, 0);
  Vector3d sum = Vector3d::Zero();
  for (PetscInt i = 0; i < ball.particles.owned; ++i) {
    sum += drag.push(i);
  }
  MPI_Allreduce(MPI_IN_PLACE, sum.data(), 3, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
  // Along x of the normal parts: integral of |cos|^3 |.| over the sphere.
  const double expected = 1.2 / 2 * 25 * M_PI * 0.25;
  EXPECT_NEAR(sum[0], expected, 0.01 * expected);
  EXPECT_LE(std::hypot(sum[1], sum[2]), 1e-3 * expected);
}

}  // namespace
}  // namespace pellicle
