#include "constraints/point_loads.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <functional>

#include "base/error.h"
#include "surface/shell.h"
#include "tests/support/grid_mesh.h"

namespace pellicle {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// A grid of 6 x 4 cells of edge 0.5 in the plane z = 0 (vertex ids run along x, 7 a row). The area round the vertex of
/// an id is made up.
class PointLoadsTest : public ::testing::Test {
 protected:
  PointLoadsTest() {
    SheetOptions options;
    options.thickness = 0.1;
    sheet = make_sheet(PETSC_COMM_WORLD, grid_mesh(6, 4, 0.5), options);
    for (const PetscInt id : sheet.persistent_id) {
      areas.push_back(area(id));
    }
    start = Field(sheet.particles, 3);
    start.values() = sheet.rest;
  }

  static double area(PetscInt id) { return 1e-4 * static_cast<double>(1 + id % 5); }

  PointLoads make(const std::map<std::string, AttachmentOptions>& attachments,
                  const std::map<std::string, PushOptions>& forces = {},
                  const std::map<std::string, BodyOptions>& bodies = {}) const {
    return {sheet, areas, attachments, forces, bodies, contact};
  }
  PointLoads press(const BodyOptions& body) const { return make({}, {}, {{"body", body}}); }

  static BodyOptions floor(double friction) {
    BodyOptions options;
    options.shape = "plane";
    options.friction = friction;
    return options;
  }

  std::string message(const std::map<std::string, AttachmentOptions>& attachments,
                      const std::map<std::string, PushOptions>& forces,
                      const std::map<std::string, BodyOptions>& bodies = {}) const {
    try {
      make(attachments, forces, bodies);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }

  /// Sum of a vector over the owned particles of all ranks.
  Vector3d sum(const std::function<Vector3d(PetscInt)>& of) const {
    Vector3d total = Vector3d::Zero();
    for (PetscInt i = 0; i < sheet.particles.owned; ++i) {
      total += of(i);
    }
    MPI_Allreduce(MPI_IN_PLACE, total.data(), 3, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
    return total;
  }

  /// Compares the gradient with differences of the value, and the Hessian with those of the gradient, less what is left
  /// out of it; and no direction has a negative curvature.
  static void expect_derivatives(const PointLoads& loads, PetscInt i, const Vector3d& x, double step,
                                 const Matrix3d& left_out = Matrix3d::Zero()) {
    const PointPotential at = loads.at(i, x);
    Vector3d gradient;
    Matrix3d hessian;
    for (int axis = 0; axis < 3; ++axis) {
      const PointPotential before = loads.at(i, x - step * Vector3d::Unit(axis));
      const PointPotential after = loads.at(i, x + step * Vector3d::Unit(axis));
      gradient[axis] = (after.value - before.value) / (2 * step);
      hessian.col(axis) = (after.gradient - before.gradient) / (2 * step);
    }
    EXPECT_LT((at.gradient - gradient).norm(), 1e-6 * at.gradient.norm());
    EXPECT_LE((at.hessian + left_out - hessian).norm(), 1e-6 * (at.hessian.norm() + left_out.norm()));
    const Vector3d curvatures =
        Eigen::SelfAdjointEigenSolver<Matrix3d>(at.hessian, Eigen::EigenvaluesOnly).eigenvalues();
    EXPECT_GE(curvatures.minCoeff(), -1e-12 * at.hessian.norm());
    EXPECT_LE((at.hessian - at.hessian.transpose()).norm(), 1e-14 * at.hessian.norm());
  }

  Sheet sheet;
  std::vector<double> areas;
  Field start;
  ContactOptions contact;
};

TEST_F(PointLoadsTest, nothing_given_is_empty) {
  EXPECT_TRUE(make({}).empty());
  EXPECT_FALSE(press(floor(0)).empty());
}

TEST_F(PointLoadsTest, attachments_pull_to_their_moving_places) {
  AttachmentOptions spring;
  spring.vertices = {8, 9, 10};
  spring.path = {{0, 0, 0, 0}, {2, 0, 0, 0.2}};
  spring.total_stiffness = 300;
  PointLoads loads = make({{"spring", spring}});
  EXPECT_FALSE(loads.empty());
  loads.begin_step(start, 1, 0.1);
  const double total = area(8) + area(9) + area(10);
  const Vector3d displacement(0.01, 0.02, -0.03);
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    const PetscInt id = sheet.persistent_id[static_cast<std::size_t>(i)];
    const Vector3d x = sheet.rest.col(i) + displacement;
    const double stiffness = id >= 8 && id <= 10 ? 300 * area(id) / total : 0;
    const Vector3d stretch(0.01, 0.02, -0.13);
    EXPECT_NEAR(loads.at(i, x).value, stiffness / 2 * stretch.squaredNorm(), 1e-13);
    EXPECT_LT((loads.at(i, x).gradient - stiffness * stretch).norm(), 1e-12);
    if (stiffness > 0) {
      expect_derivatives(loads, i, x, 1e-4);
    }
  }
}

TEST_F(PointLoadsTest, forces_add_up_to_what_is_given) {
  PushOptions push;
  push.box = {0.9, 0.9, -1, 2.1, 2.1, 1};
  push.layer = "corners";
  push.force = {{0, 0, 0, 0}, {2, 4, 6, -8}};
  PushOptions weight;
  weight.vertices = {0};
  weight.force = {{0, 0, 0, -1}};  // a single key point is a constant
  PointLoads loads = make({}, {{"push", push}, {"weight", weight}});
  loads.begin_step(start, 0.5, 0.1);
  const auto force = [&](PetscInt i) -> Vector3d { return -loads.at(i, sheet.rest.col(i)).gradient; };
  EXPECT_LT((sum(force) - Vector3d(1, 1.5, -3)).norm(), 1e-13);
  double total = 0;
  for (const int id : {16, 17, 18, 23, 24, 25, 30, 31, 32}) {
    total += area(id);
  }
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    if (sheet.persistent_id[static_cast<std::size_t>(i)] == 24) {
      EXPECT_LT((force(i) - area(24) / total * Vector3d(1, 1.5, -2)).norm(), 1e-13);
      const Vector3d displacement(0.1, 0.2, 0.3);
      EXPECT_NEAR(loads.at(i, sheet.rest.col(i) + displacement).value, -force(i).dot(displacement), 1e-13);
      expect_derivatives(loads, i, sheet.rest.col(i) + displacement, 1e-4);
    }
  }
}

TEST_F(PointLoadsTest, plane_presses_as_its_depth) {
  BodyOptions wall = floor(0);
  wall.normal = {1, 2, 2};
  wall.velocity = {0.3, 0, 0};
  wall.margin = 1e-3;
  PointLoads loads = press(wall);
  loads.begin_step(start, 2, 0.1);
  const Vector3d normal = Vector3d(1, 2, 2) / 3;
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    const double stiffness = 1e8 * area(sheet.persistent_id[static_cast<std::size_t>(i)]);
    const Vector3d surface = Vector3d(0.6, 0, 0) + Vector3d(2, -1, 0);  // the second lies in the plane
    EXPECT_EQ(loads.at(i, surface + 1.1e-3 * normal).value, 0);
    EXPECT_EQ(loads.at(i, surface + 1.1e-3 * normal).gradient, Vector3d::Zero());
    const Vector3d inside = surface + 0.4e-3 * normal;
    EXPECT_NEAR(loads.at(i, inside).value, stiffness / 2 * 0.36e-6, 1e-9 * stiffness * 1e-6);
    EXPECT_LT((loads.at(i, inside).gradient + 0.6e-3 * stiffness * normal).norm(), 1e-9 * stiffness * 1e-3);
    expect_derivatives(loads, i, inside, 1e-5);
  }
}

TEST_F(PointLoadsTest, sphere_presses_as_its_depth) {
  BodyOptions ball;
  ball.centre = {1, 0, 0};
  ball.radius = 0.2;
  ball.path = {{0, 1, 0, 0}, {1, 2, 0, 0}};
  PointLoads loads = press(ball);
  loads.begin_step(start, 1, 0.1);
  const Vector3d normal = Vector3d(2, -1, 2) / 3;
  const double depth = 0.01;
  const double distance = 0.2 - depth;
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    const double stiffness = 1e8 * area(sheet.persistent_id[static_cast<std::size_t>(i)]);
    const Vector3d x = Vector3d(2, 0, 0) + distance * normal;
    EXPECT_NEAR(loads.at(i, x).value, stiffness / 2 * depth * depth, 1e-12 * stiffness);
    const Matrix3d curvature = -stiffness * depth / distance * (Matrix3d::Identity() - normal * normal.transpose());
    expect_derivatives(loads, i, x, 1e-6, curvature);
  }
}

TEST_F(PointLoadsTest, friction_has_a_smooth_potential) {
  contact.slip_speed = 0.01;
  BodyOptions ball;
  ball.radius = 0.2;
  ball.friction = 0.4;
  ball.velocity = {0, 0, 1};
  PointLoads loads = press(ball);
  const Vector3d normal = Vector3d(2, -1, 2) / 3;
  const Vector3d tangent = Vector3d(1, 2, 0).normalized();
  const double depth = 1e-3;
  start.values().colwise() = (0.2 - depth) * normal;  // inside the ball where it is when the step begins
  loads.begin_step(start, 0.01, 0.01);
  const Vector3d carried(0, 0, 0.01);
  // Two diameters off the ball only friction is left, of the normal force at the start.
  const Vector3d away = start.vector(0) + carried + 0.8 * normal;
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    const double limit = 0.4 * depth * 1e8 * area(sheet.persistent_id[static_cast<std::size_t>(i)]);
    const double e = 0.01 * 0.01;
    EXPECT_LT(loads.at(i, away).gradient.norm(), 1e-9 * limit) << "no slip, no force";
    for (const double slip : {0.2, 0.7, 1.5, 30.0}) {
      const Vector3d x = away + slip * e * tangent;
      const double expected = slip < 1 ? 2 * slip - slip * slip : 1;
      EXPECT_LT((loads.at(i, x).gradient - limit * expected * tangent).norm(), 1e-9 * limit) << slip;
      expect_derivatives(loads, i, x, 1e-4 * e);
    }
    // Value and force run on where the slip reaches e.
    const PointPotential below = loads.at(i, away + (1 - 1e-9) * e * tangent);
    const PointPotential above = loads.at(i, away + (1 + 1e-9) * e * tangent);
    EXPECT_NEAR(below.value, above.value, 1e-8 * limit * e);
    EXPECT_LT((below.gradient - above.gradient).norm(), 1e-8 * limit);
    EXPECT_LT((below.hessian - above.hessian).norm(), 1e-8 * limit / e);
  }
}

/// A single mass on a body, moved by implicit Euler as the balloon's vertices are.
class MassOnBody {
 public:
  MassOnBody(PointLoads& loads, PetscInt particle, Field& positions)
      : loads_(loads), particle_(particle), positions_(positions) {}

  Vector3d velocity = Vector3d::Zero();

  /// @param force that acts besides [N]
  void step(double h, double mass, const Vector3d& force) {
    time_ += h;
    loads_.begin_step(positions_, time_, h);
    const Vector3d start = positions_.vector(particle_);
    const Vector3d predicted = start + h * velocity;
    const auto potential = [&](const Vector3d& x) {
      return mass / (2 * h * h) * (x - predicted).squaredNorm() - force.dot(x - start) + loads_.at(particle_, x).value;
    };
    Vector3d x = start;
    for (int n = 0; n < 100; ++n) {
      const PointPotential at = loads_.at(particle_, x);
      const Vector3d gradient = mass / (h * h) * (x - predicted) - force + at.gradient;
      const Matrix3d hessian = mass / (h * h) * Matrix3d::Identity() + at.hessian;
      Vector3d correction = -hessian.ldlt().solve(gradient);
      while (potential(x + correction) > potential(x) + 1e-4 * gradient.dot(correction) && correction.norm() > 1e-16) {
        correction /= 2;
      }
      x += correction;
    }
    velocity = (x - start) / h;
    positions_.vector(particle_) = x;
  }

 private:
  PointLoads& loads_;
  PetscInt particle_;
  Field& positions_;
  double time_ = 0;
};

TEST_F(PointLoadsTest, mass_sticks_below_the_limit_of_friction_and_slides_above) {
  const double friction = 0.5;
  const double weight = 2;  // [N]
  const double mass = 0.2;
  const double h = 0.01;
  PointLoads loads = press(floor(friction));
  const PetscInt particle = 0;
  const double depth = weight / (1e8 * areas[0]);
  for (const double pull : {0.6, 0.99, 1.5}) {  // of a limit of 1 N
    start.vector(particle) = Vector3d(0, 0, -depth);
    MassOnBody body(loads, particle, start);
    const int steps = 40;
    for (int n = 0; n < steps; ++n) {
      body.step(h, mass, Vector3d(pull, 0, -weight));
    }
    const Vector3d x = start.vector(particle);
    EXPECT_NEAR(x.z(), -depth, 1e-6 * depth);
    if (pull < 1) {
      // At rest but for the creep at which the smooth friction is as large as the pull: 2 s - s^2.
      const double creep = contact.slip_speed * (1 - std::sqrt(1 - pull));
      EXPECT_NEAR(body.velocity.x(), creep, 1e-2 * creep);
      EXPECT_LT(x.x(), contact.slip_speed * h * steps);
    } else {
      const double acceleration = (pull - 1) / mass;
      EXPECT_NEAR(body.velocity.x(), acceleration * h * steps, 1e-6);
      EXPECT_NEAR(x.x(), acceleration * h * h * steps * (steps + 1) / 2, 1e-6);
    }
  }
}

TEST_F(PointLoadsTest, moving_body_carries_a_mass_along) {
  BodyOptions belt = floor(0.5);
  belt.velocity = {0.2, 0, 0};
  PointLoads loads = press(belt);
  const double depth = 2 / (1e8 * areas[0]);
  start.vector(0) = Vector3d(0, 0, -depth);
  MassOnBody body(loads, 0, start);
  // mu N / m = 5 m/s^2: 0.15 m/s after 30 ms, and 0.2 m/s from 40 ms on.
  for (int n = 0; n < 3; ++n) {
    body.step(0.01, 0.2, Vector3d(0, 0, -2));
  }
  EXPECT_NEAR(body.velocity.x(), 0.15, 1e-6);
  for (int n = 0; n < 40; ++n) {
    body.step(0.01, 0.2, Vector3d(0, 0, -2));
  }
  EXPECT_NEAR(body.velocity.x(), 0.2, 1e-5);
}

TEST_F(PointLoadsTest, errors_name_the_object_and_the_key) {
  AttachmentOptions spring;
  EXPECT_EQ(message({{"spring", spring}}, {}).rfind("attachments.spring: selects nothing", 0), 0U);
  spring.vertices = {3};
  spring.path = {{0, 0, 0, 0}, {0, 1, 1, 1}};
  EXPECT_EQ(message({{"spring", spring}}, {}).rfind("attachments.spring.path: key point 2 is at 0", 0), 0U);
  PushOptions push;
  push.vertices = {3};
  EXPECT_EQ(message({}, {{"push", push}}),
            "forces.push.force: no key points given, expected at least one: time, x, y, z");
  push.force = {{0, 1, 1}};
  EXPECT_EQ(message({}, {{"push", push}}), "forces.push.force: key point 1 has 3 numbers, expected 4: time, x, y, z");
  push.force = {{0, 1, 1, 1}};
  push.vertices = {9999};
  EXPECT_EQ(message({}, {{"push", push}}).rfind("forces.push.vertices: 9999", 0), 0U);
  BodyOptions wall = floor(0);
  wall.normal.setZero();
  EXPECT_EQ(message({}, {}, {{"wall", wall}}).rfind("bodies.wall.normal: 0, 0, 0", 0), 0U);
}

}  // namespace
}  // namespace pellicle
