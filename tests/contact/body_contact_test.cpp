#include "contact/body_contact.h"

#include <gtest/gtest.h>

#include <cmath>

#include "surface/drawn_surface.h"
#include "surface/shell.h"
#include "tests/support/grid_mesh.h"

namespace pellicle {
namespace {

using Eigen::Vector3d;

/// A grid of 6 x 4 cells of edge 0.5 in the plane z = 0, all of it one surface, in contact at 0.05.
class BodyContactTest : public ::testing::Test {
 protected:
  BodyContactTest() {
    SheetOptions options;
    options.is_one_surface = true;
    sheet = make_sheet(PETSC_COMM_WORLD, grid_mesh(6, 4, 0.5), options);
    contact.thickness = 0.05;
    contact.stiffness = 1e4;
    contact.slip_speed = 0.01;
    start = Field(sheet.particles, 3);
    start.values() = sheet.rest;
  }

  double energy(const BodyContact& potential, const Field& x) const {
    double sum = potential.value(x);
    MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
    return sum;
  }
  double slope(const BodyContact& potential, const Field& x, const Field& direction) const {
    Eigen::Matrix3Xd gradient = Eigen::Matrix3Xd::Zero(3, sheet.particles.owned);
    potential.add_gradient(x, gradient);
    double sum = gradient.cwiseProduct(direction.values().leftCols(sheet.particles.owned)).sum();
    MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
    return sum;
  }
  /// A smooth displacement that every rank knows.
  Field wave(double size) const {
    Field result(sheet.particles, 3);
    for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
      const Vector3d x = sheet.rest.col(i);
      result.vector(i) = size * Vector3d(std::sin(3 * x.x()), std::cos(2 * x.y()), std::sin(x.x() + 4 * x.y()));
    }
    return result;
  }
  Field sum(const Field& a, const Field& b, double fraction) const {
    Field result(sheet.particles, 3);
    result.values() = a.values() + fraction * b.values();
    return result;
  }

  Sheet sheet;
  ContactOptions contact;
  Field start;
};

TEST_F(BodyContactTest, APlanePressesWithThePressureOfTheBarrier) {
  BodyOptions floor;
  floor.shape = "plane";
  floor.margin = 0.1;
  floor.point = {0, 0, -1.13};  // and after a second a gap of 0.03
  floor.velocity = {0, 0, 1};
  BodyContact potential(sheet, {{"floor", floor}}, contact, 1);
  potential.begin_step(start, 1, 0.1);
  const std::vector<BodyLoad> loads = potential.loads(start);
  ASSERT_EQ(loads.size(), 1U);
  const double pressure = 1e4 * (0.05 - 0.05 * BodyContact::onset / 2 - 0.03);
  EXPECT_LT((loads[0].force - Vector3d(0, 0, -6 * pressure)).norm(), 1e-9) << "on 6 m^2";
  EXPECT_NEAR(loads[0].gap, 0.03, 1e-12);
  PetscInt contacts = potential.contacts(start);
  MPI_Allreduce(MPI_IN_PLACE, &contacts, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD);
  EXPECT_EQ(contacts, sheet.particles.global);
}

TEST_F(BodyContactTest, WhatTouchesABodyAtFirstDoesNotPressYet) {
  BodyOptions floor;
  floor.shape = "plane";
  floor.point = {0, 0, -0.02};
  BodyContact potential(sheet, {{"floor", floor}}, contact, 1);
  potential.begin_step(start, 0.1, 0.1);
  EXPECT_EQ(potential.loads(start)[0].force.norm(), 0);
  Field lower(sheet.particles, 3);
  lower.values() = start.values().colwise() - Vector3d(0, 0, 0.01);
  EXPECT_LT(potential.loads(lower)[0].force.z(), -1);
}

TEST_F(BodyContactTest, TheGradientIsThatOfTheValue) {
  BodyOptions ball;
  ball.path = {{0, 1.3, 0.9, -2}, {0.1, 1.3, 0.9, -0.62}, {0.2, 1.31, 0.9, -0.6}};
  ball.radius = 0.6;
  ball.friction = 0.4;
  BodyOptions rod;
  rod.shape = "capsule";
  rod.axis = {1, 0.3, 0};
  rod.path = {{0, 0.8, 0.2, 1}, {0.1, 0.8, 0.2, 0.06}};
  rod.radius = 0.03;
  rod.friction = 0.2;
  BodyContact potential(sheet, {{"ball", ball}, {"rod", rod}}, contact, 1);
  potential.begin_step(start, 0.2, 0.1);
  EXPECT_GT(potential.pattern_version(), 0) << "elements are nearer than particles";
  const Field x = sum(start, wave(0.01), 1);
  const Field direction = wave(1);
  const double step = 1e-6;
  const double by_differences =
      (energy(potential, sum(x, direction, step)) - energy(potential, sum(x, direction, -step))) / (2 * step);
  const double exact = slope(potential, x, direction);
  EXPECT_GT(std::abs(exact), 1e-3);
  EXPECT_NEAR(by_differences, exact, 1e-6 * std::abs(exact) + 1e-9);
}

/// Takes the Hessian's blocks, of the owned rows, and multiplies with a field.
class Product : public HessianBlocks {
 public:
  Product(const BodyContact& potential, const Layout& layout, const Field& by)
      : pattern_(potential.pattern()), layout_(layout), by_(by) {
    result_ = Eigen::Matrix3Xd::Zero(3, layout.owned);
  }
  void add(std::size_t pair, const Eigen::Matrix3d& block) const override {
    const auto& [row, column] = pattern_[pair];
    if (row >= layout_.owned) {
      return;
    }
    for (PetscInt i = 0; i < layout_.local(); ++i) {
      if (layout_.to_global(i) == column) {
        result_.col(row) += block * by_.vector(i);
      }
    }
  }
  const Eigen::Matrix3Xd& result() const { return result_; }

 private:
  std::vector<VertexPair> pattern_;
  const Layout& layout_;
  const Field& by_;
  mutable Eigen::Matrix3Xd result_;
};

TEST_F(BodyContactTest, TheHessianIsExactForPlanesAndPositive) {
  BodyOptions floor;
  floor.shape = "plane";
  floor.point = {0, 0, -0.13};
  floor.velocity = {0, 0, 1};
  BodyOptions ball;
  ball.centre = {1.3, 0.9, 0.7};
  ball.velocity = {0, 0, -1};
  ball.radius = 0.58;
  for (const bool is_plane : {true, false}) {
    BodyContact potential(sheet, {{"body", is_plane ? floor : ball}}, contact, 1);
    potential.begin_step(start, 0.1, 0.1);
    const Field x = sum(start, wave(0.005), 1);
    const Field direction = wave(1);
    potential.update_hessian(x, Curvature::psd);
    const Product product(potential, sheet.particles, direction);
    potential.add_hessian(product);
    double curvature = product.result().cwiseProduct(direction.values().leftCols(sheet.particles.owned)).sum();
    MPI_Allreduce(MPI_IN_PLACE, &curvature, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
    EXPECT_GT(curvature, 0);
    const double step = 1e-6;
    const double by_differences =
        (slope(potential, sum(x, direction, step), direction) - slope(potential, sum(x, direction, -step), direction)) /
        (2 * step);
    if (is_plane) {
      EXPECT_NEAR(curvature, by_differences, 1e-5 * curvature);
    } else {
      EXPECT_GE(curvature, by_differences - 1e-5 * curvature) << "less the ball's own curvature";
    }
  }
}

TEST_F(BodyContactTest, NothingPassesThroughAThinBody) {
  BodyOptions wire;
  wire.shape = "capsule";
  wire.axis = {1, 0.2, 0};
  wire.centre = {1.4, 0.8, -0.5};
  wire.radius = 0.01;
  wire.length = 1;
  contact.thickness = 0.02;
  BodyContact potential(sheet, {{"wire", wire}}, contact, 1);
  potential.begin_step(start, 0.1, 0.1);
  Field x = sum(start, start, 0);
  x.values().row(2).array() -= 1;  // The wire is half way down.
  potential.start_from(start, x, 0.1);
  const Solid solid = potential.bodies()[0].at(0.1);
  double lowest = 0;
  for (PetscInt i = 0; i < sheet.particles.owned; ++i) {
    lowest = std::min(lowest, x.vector(i).z());
  }
  MPI_Allreduce(MPI_IN_PLACE, &lowest, 1, MPI_DOUBLE, MPI_MIN, PETSC_COMM_WORLD);
  EXPECT_EQ(lowest, -1) << "what does not meet the wire goes all the way";
  // The ends of the wire's axis are still below the sheet: each on the side where it was.
  EXPECT_EQ(potential.sweep().fault(potential.loads(x)), "");
  for (std::size_t t = 0; t < sheet.triangles.size(); ++t) {
    const auto corners = DrawnPlaces(sheet, x.data(), t / 4)(sheet.triangles[t]);
    const auto over = corners[0].head<2>();
    if ((over - wire.centre.head<2>()).norm() < 0.1) {
      EXPECT_GT(corners[0].z(), -0.5);
    }
  }
  // Nor does a step of Newton's method from there.
  Eigen::Matrix3Xd step = Eigen::Matrix3Xd::Zero(3, sheet.particles.owned);
  step.row(2).setConstant(-1);
  EXPECT_TRUE(potential.limit(x, StepLimit::each_vertex, step));
  x.values().leftCols(step.cols()) += step;
  x.update_ghosts();
  EXPECT_GT(potential.loads(x)[0].gap, -0.02);
}

TEST_F(BodyContactTest, ZeroMarginAndDegenerateTrianglesPressAsWell) {
  // Two corners of each cell at the same place, the sheet folded to a line.
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    start.vector(i).y() = 0;
  }
  BodyOptions box;
  box.shape = "box";
  box.size = {0.3, 0.3, 0.3};
  box.centre = {1.25, 0, -0.17};  // between the corners at 1 and 1.5
  BodyContact potential(sheet, {{"box", box}}, contact, 1);
  potential.begin_step(start, 1, 0.1);
  const std::vector<BodyLoad> loads = potential.loads(start);
  EXPECT_NEAR(loads[0].gap, 0.02, 1e-3);
  EXPECT_LT(loads[0].force.z(), -1);
  EXPECT_TRUE(std::isfinite(energy(potential, start)));
}

}  // namespace
}  // namespace pellicle
