#include "contact/body_correction.h"

#include <gtest/gtest.h>
#include <petscsys.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "base/error.h"

namespace pellicle {
namespace {

constexpr double g = 9.81;

/// Free particles, as many on every rank, that bodies act on without a sheet between them.
class BodyCorrectionTest : public ::testing::Test {
 protected:
  explicit BodyCorrectionTest(PetscInt count = 3)
      : pinned(static_cast<std::size_t>(count), false), mass(static_cast<std::size_t>(count), 0.1) {
    MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
    Layout& particles = surface.particles;
    particles.comm = PETSC_COMM_WORLD;
    particles.owned = count;
    MPI_Allreduce(&count, &particles.global, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD);
    particles.first = rank * count;
    start = Field(particles, 3);
    positions = Field(particles, 3);
    velocities = Field(particles, 3);
  }

  /// One step of section 7 for particles without springs.
  void advance(BodyCorrection& bodies, double h, const Eigen::Vector3d& gravity = {0, 0, -g}) {
    start.values() = positions.values();
    velocities.values().colwise() += h * gravity;
    positions.values() += h * velocities.values();
    time += h;
    const ContactStep step{start, pinned, time, h, mass};
    correct(bodies, step);
    velocities.values() = (positions.values() - start.values()) / h;
    bodies.correct_velocities(velocities, positions, step);
  }

  PetscInt correct(BodyCorrection& bodies, const ContactStep& step) {
    bodies.begin_step(step, nullptr);
    bodies.correct_positions(positions, step);
    return bodies.contacts();
  }

  BodyCorrection one(const BodyOptions& options) const { return BodyCorrection(surface, {{"body", options}}, 0.002); }
  static BodyOptions plane(const Eigen::Vector3d& normal, double friction) {
    BodyOptions options;
    options.shape = "plane";
    options.normal = normal;
    options.friction = friction;
    return options;
  }

  int rank = 0;
  Surface surface;  ///< without elements
  const Layout& particles = surface.particles;
  Field start;
  Field positions;
  Field velocities;
  std::vector<bool> pinned;
  std::vector<double> mass;
  double time = 0;
};

TEST_F(BodyCorrectionTest, SpherePushesOutToItsRadiusAndMargin) {
  BodyOptions ball;
  ball.centre = {1, 2, 3};
  ball.radius = 0.5;
  ball.margin = 0.01;
  const Eigen::Vector3d direction = Eigen::Vector3d(2, -1, 2) / 3;
  positions.vector(0) = ball.centre + 0.2 * direction;
  positions.vector(1) = ball.centre + 0.505 * direction;
  positions.vector(2) = ball.centre + 0.52 * direction;
  start.values() = positions.values();
  BodyCorrection bodies = one(ball);
  EXPECT_EQ(correct(bodies, {start, pinned, 1, 1, mass}), 2);
  EXPECT_LT((positions.vector(0) - ball.centre - 0.51 * direction).norm(), 1e-12);
  EXPECT_LT((positions.vector(1) - ball.centre - 0.51 * direction).norm(), 1e-12);
  EXPECT_EQ(positions.vector(2), ball.centre + 0.52 * direction) << "left alone";
}

TEST_F(BodyCorrectionTest, FrictionOnASphereLeavesPointsOnIt) {
  BodyOptions ball;
  ball.radius = 0.5;
  ball.friction = 0.3;
  for (PetscInt i = 0; i < 3; ++i) {
    start.vector(i) = Eigen::Vector3d(0, 0, 0.5);
    positions.vector(i) = Eigen::Vector3d(0.1 * static_cast<double>(i), 0, 0.45);
  }
  const Eigen::Matrix3Xd before = positions.values();
  BodyCorrection bodies = one(ball);
  EXPECT_EQ(correct(bodies, {start, pinned, 1, 1, mass}), 3);
  for (PetscInt i = 0; i < 3; ++i) {
    const Eigen::Vector3d normal = before.col(i).normalized();
    const Eigen::Vector3d pushed = 0.5 * normal;
    Eigen::Vector3d slip = pushed - start.vector(i);
    slip -= normal * normal.dot(slip);
    const double kept = i == 0 ? 0 : std::max(0.0, 1 - 0.3 * (0.5 - before.col(i).norm()) / slip.norm());
    EXPECT_LT((positions.vector(i) - 0.5 * (pushed - (1 - kept) * slip).normalized()).norm(), 1e-12);
  }
  EXPECT_LT(positions.vector(2).x(), 0.5 * before.col(2).normalized().x() - 0.002) << "the slip is less by mu d";
}

TEST_F(BodyCorrectionTest, BlockOnASlopeSticksBelowTheAngleOfFriction) {
  BodyCorrection slope = one(plane({0.5, 0, 1}, 0.51));  // tan = 0.5
  for (int n = 0; n < 200; ++n) {
    advance(slope, 0.01);
  }
  EXPECT_LT(positions.values().cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT(velocities.values().cwiseAbs().maxCoeff(), 1e-12);
}

TEST_F(BodyCorrectionTest, BlockOnASlopeSlidesWithGravityLessFriction) {
  const double angle = std::atan(0.5);
  const Eigen::Vector3d downhill(std::cos(angle), 0, -std::sin(angle));
  for (const double friction : {0.0, 0.3}) {
    positions.values().setZero();
    velocities.values().setZero();
    BodyCorrection slope = one(plane({0.5, 0, 1}, friction));
    for (int n = 0; n < 200; ++n) {
      advance(slope, 0.01);
    }
    const double acceleration = g * (std::sin(angle) - friction * std::cos(angle));
    EXPECT_LT((velocities.vector(0) - 2 * acceleration * downhill).norm(), 1e-10);
    // Symplectic Euler: h^2 a (1 + 2 + ... + n).
    EXPECT_LT((positions.vector(0) - 1e-4 * acceleration * 200 * 201 / 2 * downhill).norm(), 1e-10);
  }
}

TEST_F(BodyCorrectionTest, ImpactTakesTheNormalVelocityAndItsShareOfTheSlip) {
  BodyCorrection floor = one(plane({0, 0, 1}, 0.2));
  positions.vector(0) = Eigen::Vector3d(0, 0, 0.004);
  velocities.vector(0) = Eigen::Vector3d(1, 0, -2);  // slides on: 1 - 0.2 * 2
  positions.vector(1) = Eigen::Vector3d(0, 0, 0.004);
  velocities.vector(1) = Eigen::Vector3d(0.3, 0, -2);  // sticks: 0.3 < 0.2 * 2
  positions.vector(2) = Eigen::Vector3d(0, 0, 0.004);
  velocities.vector(2) = Eigen::Vector3d(1, 0, 0.5);  // flies off
  advance(floor, 0.01, Eigen::Vector3d::Zero());
  EXPECT_NEAR(positions.vector(0).z(), 0, 1e-15);
  EXPECT_LT((velocities.vector(0) - Eigen::Vector3d(0.6, 0, 0)).norm(), 1e-12);
  EXPECT_LT(velocities.vector(1).norm(), 1e-12);
  EXPECT_LT((velocities.vector(2) - Eigen::Vector3d(1, 0, 0.5)).norm(), 1e-12);
}

TEST_F(BodyCorrectionTest, MovingFloorCarriesPointsAlong) {
  BodyOptions options = plane({0, 0, 1}, 0.5);
  options.velocity = {1, 0, 0};
  BodyCorrection floor = one(options);
  const double time_to_stick = 1 / (0.5 * g);
  for (int n = 0; n < 10; ++n) {
    advance(floor, 0.01);
  }
  ASSERT_LT(time, time_to_stick);
  EXPECT_NEAR(velocities.vector(0).x(), 0.5 * g * time, 1e-12) << "pulled by mu m g";
  for (int n = 0; n < 90; ++n) {
    advance(floor, 0.01);
  }
  EXPECT_NEAR(velocities.vector(0).x(), 1, 1e-12);
  EXPECT_NEAR(positions.vector(0).x(), 1 - time_to_stick / 2, 0.01) << "it slips while it is accelerated";
  EXPECT_NEAR(positions.vector(0).z(), 0, 1e-12);
}

TEST_F(BodyCorrectionTest, BodyFollowsItsKeyPoints) {
  BodyOptions options = plane({0, 0, 1}, 0);
  options.path = {{0, 0, 0, -1}, {1, 0, 0, 0.5}, {2, 0, 0, 0.5}};
  BodyCorrection lift = one(options);
  positions.values().setZero();
  for (int n = 0; n < 150; ++n) {
    advance(lift, 0.01, Eigen::Vector3d::Zero());
    if (n == 49) {
      EXPECT_EQ(positions.vector(0).z(), 0) << "the floor is still below";
    }
    if (n == 90) {
      EXPECT_NEAR(positions.vector(0).z(), 1.5 * time - 1, 1e-12);
      EXPECT_NEAR(velocities.vector(0).z(), 1.5, 1e-10);
    }
  }
  EXPECT_NEAR(velocities.vector(0).z(), 1.5, 1e-10) << "thrown off where the floor stops";
  EXPECT_NEAR(positions.vector(0).z(), 0.5 + 1.5 * 0.5, 1e-10);
}

TEST_F(BodyCorrectionTest, TurningDrumCarriesPointsRound) {
  BodyOptions drum;
  drum.shape = "cylinder";
  drum.axis = {0, 1, 0};
  drum.radius = 0.5;
  drum.angular_velocity = {0, 2, 0};
  drum.friction = 200;  // enough to take them along at once
  BodyCorrection bodies = one(drum);
  positions.values().row(2).setConstant(0.5);
  advance(bodies, 1e-3);
  for (PetscInt i = 0; i < 3; ++i) {
    EXPECT_LT((velocities.vector(i) - Eigen::Vector3d(1, 0, 0)).norm(), 2e-3) << "omega r along x at the top";
  }
}

TEST_F(BodyCorrectionTest, ForceAtRestIsTheWeight) {
  BodyCorrection floor = one(plane({0, 0, 1}, 0.5));
  for (int n = 0; n < 3; ++n) {
    advance(floor, 0.01);
    const std::vector<BodyLoad> loads = floor.loads(positions, {start, pinned, time, 0.01, mass});
    const double weight = 0.1 * g * static_cast<double>(particles.global);
    EXPECT_LT((loads[0].force - Eigen::Vector3d(0, 0, -weight)).norm(), 1e-9 * weight);
    EXPECT_NEAR(loads[0].gap, 0, 1e-15);
  }
}

TEST_F(BodyCorrectionTest, ParticlesReboundWithTheRestitution) {
  BodyOptions options = plane({0, 0, 1}, 0);
  options.restitution = 0.6;
  BodyCorrection floor = one(options);
  positions.values().row(2).setConstant(0.004);
  velocities.values().row(2).setConstant(-2);
  const Field before = [this] {
    Field copy(particles, 3);
    copy.values() = velocities.values();
    return copy;
  }();
  start.values() = positions.values();
  positions.values() += 0.01 * velocities.values();
  const ContactStep step{start, pinned, 0.01, 0.01, mass, &before};
  correct(floor, step);
  velocities.values() = (positions.values() - start.values()) / 0.01;
  floor.correct_velocities(velocities, positions, step);
  EXPECT_NEAR(velocities.vector(0).z(), 1.2, 1e-12);
  const double impulse = 0.01 * floor.loads(positions, step)[0].force.z();
  EXPECT_NEAR(impulse, -0.1 * 3.2 * static_cast<double>(particles.global), 1e-9) << "what the momentum has changed by";
}

TEST_F(BodyCorrectionTest, PinnedParticlesAreLeftAlone) {
  pinned[1] = true;
  positions.values().row(2).setConstant(-0.1);
  velocities.values().row(2).setConstant(-1);
  const ContactStep step{start, pinned, 1, 1, mass};
  BodyCorrection floor = one(plane({0, 0, 1}, 0.5));
  EXPECT_EQ(correct(floor, step), 2);
  EXPECT_EQ(positions.vector(0).z(), 0);
  EXPECT_EQ(positions.vector(1).z(), -0.1);
  floor.correct_velocities(velocities, positions, step);
  EXPECT_EQ(velocities.vector(0).z(), 0);
  EXPECT_EQ(velocities.vector(1).z(), -1);
  EXPECT_EQ(velocities.vector(2).z(), 0);
}

std::string message(const BodyOptions& options) {
  try {
    make_bodies(PETSC_COMM_WORLD, {{"ball", options}});
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(BodiesErrors, NameTheBodyAndTheKey) {
  BodyOptions flat;
  flat.shape = "plane";
  flat.normal.setZero();
  EXPECT_EQ(message(flat).rfind("bodies.ball.normal:", 0), 0U);
  BodyOptions twice;
  twice.velocity = {1, 0, 0};
  twice.path = {{0, 0, 0, 0}};
  EXPECT_EQ(message(twice).rfind("bodies.ball: both", 0), 0U);
  BodyOptions backwards;
  backwards.path = {{1, 0, 0, 0}, {0, 0, 0, 0}};
  EXPECT_EQ(message(backwards).rfind("bodies.ball.path: key point 2", 0), 0U);
  BodyOptions spun;
  spun.angular_velocity = {1, 0, 0};
  spun.rotation = {{0, 0, 0, 0}};
  EXPECT_EQ(message(spun).rfind("bodies.ball: both rotation", 0), 0U);
  BodyOptions ring;
  ring.shape = "ring";
  ring.tube_radius = 0.2;
  EXPECT_EQ(message(ring), "bodies.ball.tube_radius: 0.2 m, expected less than the radius 0.1 m");
  BodyOptions rod;
  rod.shape = "capsule";
  rod.axis.setZero();
  EXPECT_EQ(message(rod).rfind("bodies.ball.axis: 0, 0, 0 given", 0), 0U);
  BodyOptions mesh;
  mesh.shape = "mesh";
  EXPECT_EQ(message(mesh).rfind("bodies.ball.file: ", 0), 0U);
}

TEST(BodiesErrors, OpenMeshesAreNoBodies) {
  BodyOptions mesh;
  mesh.shape = "mesh";
  mesh.file = (std::filesystem::temp_directory_path() / "pellicle_open_body.obj").string();
  int rank = 0;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  if (rank == 0) {
    std::ofstream(mesh.file) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\n";
  }
  MPI_Barrier(PETSC_COMM_WORLD);
  const std::string text = message(mesh);
  EXPECT_NE(text.find("has a face on one side alone, expected a closed mesh"), std::string::npos) << text;
}

}  // namespace
}  // namespace pellicle
