#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "contact/body_contact.h"
#include "geometry/deepest_point.h"
#include "geometry/pi.h"
#include "surface/drawn_surface.h"
#include "tests/support/alone.h"
#include "tests/support/grid_mesh.h"

namespace pellicle::sheet_on_bodies_test {
namespace {

using Eigen::Vector3d;

constexpr double g = 9.81;
constexpr double edge = 0.05;

Options elastic_options() {
  Options options;
  options.dynamics = Dynamics::elastic;
  options.sheet.areal_density = 0.5;
  options.material.tensile_stiffness = 300;
  options.material.shear_stiffness = 100;
  options.material.bending_stiffness = 1e-3;
  options.force.gravity = {0, 0, -g};
  options.contact.stiffness = 1e6;
  return options;
}

/// A sheet, of 8 x 6 cells unless there is another mesh, in steps of one length.
struct MovingSheet : Alone {
  explicit MovingSheet(const Options& options, double h = 2e-3, const SurfaceMesh& mesh = grid_mesh(8, 6, edge))
      : Alone(mesh, options), h(h) {}

  AloneStep step() {
    const AloneStep result = advance(h);
    EXPECT_TRUE(result.converged) << state().step << ": " << result.reason;
    return result;
  }
  /// Until a time. @returns the last step
  AloneStep reach(double time) {
    AloneStep last;
    while (state().time < time - 1e-9 && !::testing::Test::HasFailure()) {
      last = step();
    }
    return last;
  }
  Vector3d mean_velocity() const { return momentum() / mass(); }
  /// The least gap of a surface triangle of this rank from a body.
  double least_gap(const BodyOptions& body) const {
    const Solid solid = make_bodies(PETSC_COMM_WORLD, {{"body", body}})[0].at(state().time);
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t t = 0; t < surface().triangles.size(); ++t) {
      const auto corners = DrawnPlaces(surface(), state().position.data(), t / 4)(surface().triangles[t]);
      least = std::min(least, deepest_point(solid, corners, 100, 1e-5)->gap.distance);
    }
    return least;
  }

  double h;
};

BodyOptions plane(double friction, const Vector3d& normal = Vector3d::UnitZ()) {
  BodyOptions body;
  body.shape = "plane";
  body.normal = normal;
  body.friction = friction;
  return body;
}

TEST(SheetOnBodies, AtRestTheForceOnABodyIsTheWeight) {
  Options options = elastic_options();
  options.bodies["floor"] = plane(0.3);
  options.bodies["floor"].point = {0, 0, -0.005};
  MovingSheet sheet(options);
  const AloneStep last = sheet.reach(0.4);
  ASSERT_EQ(last.loads.size(), 1U);
  EXPECT_NEAR(last.loads[0].force.z(), -sheet.mass() * g, 0.01 * sheet.mass() * g);
  EXPECT_LT(last.loads[0].force.head<2>().norm(), 0.01 * sheet.mass() * g);
  EXPECT_GT(last.loads[0].gap, 0.9 * 0.1 * edge) << "the weight presses the contact by less than a tenth";
}

constexpr double slope = 0.5;
const Vector3d downhill = Vector3d(1, 0, -slope).normalized();
const Vector3d off_the_slope = Vector3d(slope, 0, 1).normalized();

/// A sheet that is as stiff as a block on a slope, some time after it was laid there, and what it does then.
struct OnASlope {
  double acceleration = 0;  ///< downhill, its mean over the second half [m/s^2]
  double speed = 0;         ///< at the end [m/s]
  double strict = 0;        ///< of a block that slides, by Coulomb [m/s^2]
};

/// @param bodies on which it lies
OnASlope slide(double friction, double time, const std::map<std::string, BodyOptions>& bodies) {
  Options options = elastic_options();
  options.material.bending_stiffness = 10;
  options.bodies = bodies;
  for (auto& [name, body] : options.bodies) {
    body.friction = friction;
  }
  SurfaceMesh mesh = grid_mesh(8, 5, edge);
  for (Vector3d& point : mesh.points) {
    point = point.x() * downhill + point.y() * Vector3d::UnitY();
  }
  MovingSheet sheet(options, 2e-3, mesh);
  sheet.reach(time / 2);
  const Vector3d before = sheet.mean_velocity();
  sheet.reach(time);
  return {(sheet.mean_velocity() - before).dot(downhill) / (time / 2), sheet.mean_velocity().norm(),
          g * (-downhill.z() - friction * off_the_slope.z())};
}

void expect_coulomb(double time, const std::map<std::string, BodyOptions>& bodies) {
  for (const double friction : {0.55, 0.45, 0.2}) {
    const OnASlope found = slide(friction, time, bodies);
    if (friction > slope) {
      EXPECT_LT(found.speed, elastic_options().contact.slip_speed) << friction;
    } else {
      EXPECT_NEAR(found.acceleration, found.strict, 0.02 * g * -downhill.z()) << friction;
    }
  }
}

TEST(SheetOnBodies, ABlockSticksBelowTheAngleOfFrictionAndSlidesAbove) {
  // It begins where the barrier bears it.
  const double thickness = 0.1 * edge;
  const double onset = BodyContact::onset * thickness;
  const double pressure = 0.5 * g * off_the_slope.z();
  const double gap = thickness - std::sqrt(2 * onset * pressure / *elastic_options().contact.stiffness);
  ASSERT_GT(gap, thickness - onset);
  BodyOptions ground = plane(0, off_the_slope);
  ground.point = -gap * off_the_slope;
  expect_coulomb(0.2, {{"ground", ground}});
}

// They are round, and touch it between the rows of its particles.
TEST(SheetOnBodies, OnRailsABlockSticksBelowTheAngleOfFrictionAndSlidesAbove) {
  std::map<std::string, BodyOptions> rails;
  for (const double y : {0.03, 0.22}) {
    BodyOptions& rail = rails[y < 0.1 ? "left" : "right"];
    rail.shape = "capsule";
    rail.axis = downhill;
    rail.length = 2;
    rail.radius = 0.05;
    rail.centre = 4 * edge * downhill + y * Vector3d::UnitY() - (rail.radius + 0.095 * edge) * off_the_slope;
  }
  expect_coulomb(0.6, rails);
}

/// By every way to move a sheet.
class AnySheetOnBodies : public ::testing::TestWithParam<std::string> {
 protected:
  static Options options() {
    Options options = elastic_options();
    options.dynamics = GetParam();
    options.spring.stiffness = 300;
    return options;
  }
};
INSTANTIATE_TEST_SUITE_P(Dynamics, AnySheetOnBodies, ::testing::Values("elastic", "projection", "spring"),
                         [](const auto& info) { return info.param; });

TEST_P(AnySheetOnBodies, NoDrawnTriangleEntersABody) {
  std::map<std::string, BodyOptions> bodies;
  bodies["ball"].radius = 0.03;
  bodies["rod"].shape = "capsule";
  bodies["rod"].axis = {1, 0.4, 0};
  bodies["rod"].radius = 0.01;
  bodies["box"].shape = "box";
  bodies["box"].size = {0.06, 0.06, 0.06};
  bodies["box"].rotation = {{0, 0.6, 0.6, 0}};
  bodies["ring"].shape = "ring";
  bodies["ring"].radius = 0.06;
  bodies["ring"].tube_radius = 0.012;
  bodies["ring"].axis = {0, 0.5, 1};
  bodies["drum"].shape = "cylinder";
  bodies["drum"].radius = 0.04;
  bodies["drum"].axis = {0.3, 1, 0.5};
  for (auto& [name, body] : bodies) {
    body.centre = {4.4 * edge, 2.6 * edge, -0.1};  // between corners
    body.friction = 0.3;
    Options of_body = options();
    of_body.bodies[name] = body;
    MovingSheet sheet(of_body);
    double least = 1;
    for (int n = 0; n < 100 && !::testing::Test::HasFailure(); ++n) {
      sheet.step();
      least = std::min(least, sheet.least_gap(body));
    }
    EXPECT_GE(least, -0.1 * 0.1 * edge) << name;
    EXPECT_LT(least, 0.1 * edge) << name << " is not reached";
  }
}

// The ball flies 80 mm, more than its diameter, in a step.
TEST_P(AnySheetOnBodies, NothingFastTunnels) {
  Options options = AnySheetOnBodies::options();
  options.force.gravity.setZero();
  BodyOptions ball;
  ball.radius = 0.03;
  ball.centre = {4.4 * edge, 2.6 * edge, -0.2};
  ball.velocity = {0, 0, 40};
  options.bodies["ball"] = ball;
  options.elastic.max_iterations = 300;
  options.project.error_limit = 10;
  MovingSheet sheet(options);
  for (int n = 0; n < 8 && !::testing::Test::HasFailure(); ++n) {
    sheet.step();
    EXPECT_GE(sheet.least_gap(ball), -0.1 * 0.1 * edge) << n;
  }
  // The sheet has been taken along and lies over the ball.
  const double highest = sheet.state().position.values().row(2).maxCoeff();
  double of_all = highest;
  MPI_Allreduce(MPI_IN_PLACE, &of_all, 1, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD);
  EXPECT_GT(of_all, -0.2 + 40 * sheet.state().time);
}

// The upper half of a U falls on the lower half, which lies on the floor.
TEST_P(AnySheetOnBodies, ItsContactWithItselfPressesItIntoNone) {
  Options options = AnySheetOnBodies::options();
  options.force.gravity *= 10;
  options.contact.self = true;
  options.contact.stiffness.reset();
  const BodyOptions floor = plane(0.3);
  options.bodies["floor"] = floor;
  SurfaceMesh mesh = grid_mesh(8, 3, edge);
  const double radius = 2 * edge / pi;
  for (Vector3d& point : mesh.points) {
    const double beyond = point.x() - 3 * edge;
    if (beyond > 0) {
      const double turn = std::min(beyond / radius, pi);
      point.x() = 3 * edge + radius * std::sin(turn) - std::max(0.0, beyond - 2 * edge);
      point.z() = radius * (1 - std::cos(turn));
    }
    point.z() += 0.02 * edge;
  }
  MovingSheet sheet(options, 2e-3, mesh);
  PetscInt touching = 0;
  for (int n = 0; n < 60 && !::testing::Test::HasFailure(); ++n) {
    touching = std::max(touching, sheet.step().balance.contact->contacts);
    EXPECT_GE(sheet.least_gap(floor), -0.1 * 0.1 * edge) << n;
  }
  EXPECT_GT(touching, 0) << "the halves do not meet";
}

TEST(SheetOnBodies, AStrainLimitHoldsWhereTrianglesKeepOutOfABall) {
  Options options = elastic_options();
  options.dynamics = Dynamics::projection;
  options.project.strain_limit = 0.01;
  BodyOptions ball;
  ball.radius = 0.08;
  ball.centre = {4.4 * edge, 2.6 * edge, -0.1};
  ball.friction = 0.3;
  options.bodies["ball"] = ball;
  MovingSheet sheet(options);
  double least = 1;
  for (int n = 0; n < 60 && !::testing::Test::HasFailure(); ++n) {
    sheet.step();
    EXPECT_LE(sheet.object.last_step().strain->largest, 0.01) << n;
    least = std::min(least, sheet.least_gap(ball));
  }
  EXPECT_GE(least, -0.1 * 0.1 * edge);
  EXPECT_LE(least, 0) << "it does not lie on the ball";
}

TEST(SheetOnBodies, ABouncingSheetGainsNoEnergy) {
  Options options = elastic_options();
  BodyOptions floor = plane(0.3);
  floor.point = {0, 0, -0.1};
  floor.restitution = 0.8;
  options.bodies["floor"] = floor;
  MovingSheet sheet(options);
  const auto energy = [&sheet] {
    return sheet.sum([&](PetscInt i) {
      const double m = sheet.burning().mass.data()[i];
      return m * sheet.state().velocity.vector(i).squaredNorm() / 2 + m * g * sheet.state().position.vector(i).z();
    });
  };
  const double scale = sheet.mass() * g * 0.1;
  double before = energy();
  double highest = -1;  // after the impact
  for (int n = 0; n < 250 && !::testing::Test::HasFailure(); ++n) {
    sheet.step();
    const double now = energy();
    EXPECT_LE(now, before + 1e-3 * scale) << n;
    before = std::min(before, now);
    if (sheet.state().time > 0.2) {
      highest = std::max(highest, sheet.state().position.vector(0).z());
    }
  }
  // A height of e^2 times that of the fall.
  EXPECT_NEAR(highest + 0.1, 0.64 * 0.1, 0.015);
}

TEST(SheetOnBodies, ACellThatFallsOnASmallBallBouncesToo) {
  for (const Dynamics dynamics : {Dynamics::elastic, Dynamics::projection}) {
    Options options = elastic_options();
    options.dynamics = dynamics;
    options.force.damping = 0;
    BodyOptions ball;
    ball.radius = 0.1 * edge;
    ball.centre = {0.5 * edge, 0.5 * edge, -0.1 - ball.radius};
    ball.restitution = 0.8;
    options.bodies["ball"] = ball;
    MovingSheet sheet(options, 1e-3, grid_mesh(1, 1, edge));
    sheet.reach(0.18);
    // An elastic sheet rebounds from the thickness of contact, a projected one from the ball itself.
    const double arrives = std::sqrt(2 * g * (dynamics == Dynamics::elastic ? 0.1 - 0.1 * edge : 0.1));
    EXPECT_NEAR(sheet.mean_velocity().z(), 0.8 * arrives - g * (0.18 - arrives / g), 0.03);
  }
}

TEST(SheetOnBodies, ATurningDrumDragsTheSheet) {
  Options options = elastic_options();
  BodyOptions drum;
  drum.shape = "cylinder";
  drum.axis = {0, 1, 0};
  drum.length = 1;
  drum.radius = 0.5;
  drum.centre = {4 * edge, 3 * edge, -0.506};
  drum.angular_velocity = {0, 1, 0};
  drum.friction = 0.5;
  options.bodies["drum"] = drum;
  MovingSheet sheet(options);
  sheet.reach(0.3);
  // It lies from 0.1 rad before the top to 0.7 rad behind it.
  EXPECT_NEAR(sheet.mean_velocity().x(), 0.505 * (std::sin(0.7) + std::sin(0.1)) / 0.8, 0.02);
}

/// A strip of n x n/20 cells that lies over a drum and hangs down by its weight.
SurfaceMesh strip(int n) { return moved(grid_mesh(n, n / 20, 0.4 / n), {-0.2, 0, 0}); }

/// Heat that the strip has got in 0.4 s [J].
double heat_of_drum(Dynamics dynamics, double thickness, int n) {
  Options options = elastic_options();
  options.dynamics = dynamics;
  options.material.bending_stiffness = 1e-6;
  options.sheet.thickness = 5e-4;
  options.force.damping = 10;
  options.contact.thickness = thickness;
  options.heat.diffusivity = 0;
  BodyOptions& drum = options.bodies["drum"];
  drum.shape = "cylinder";
  drum.axis = {0, 1, 0};
  drum.length = 1;
  drum.radius = 0.05;
  drum.centre = {0, 0, -0.05};
  drum.friction = 1;
  drum.temperature = 400;
  MovingSheet sheet(options, 5e-3, strip(n));
  sheet.state().position.values().row(2).array() += 2e-3;
  sheet.reach(0.4);
  return sheet.sum([&](PetscInt i) {
    return options.heat.capacity * sheet.burning().mass.data()[i] *
           (sheet.burning().temperature.data()[i] - options.heat.initial_temperature);
  });
}

// The strip rests on the drum at a gap of the thickness, or of 0 if it is projected, and touches it by the same length.
TEST(SheetOnBodies, HeatOfADrumDependsNeitherOnTheMeshNorOnTheThicknessOfContact) {
  const double heat = heat_of_drum(Dynamics::elastic, 5e-4, 40);
  EXPECT_GT(heat, 10);
  EXPECT_NEAR(heat_of_drum(Dynamics::elastic, 2e-4, 40), heat, 0.02 * heat);
  EXPECT_NEAR(heat_of_drum(Dynamics::elastic, 1e-3, 40), heat, 0.02 * heat);
  EXPECT_NEAR(heat_of_drum(Dynamics::elastic, 5e-4, 20), heat, 0.05 * heat);
  EXPECT_NEAR(heat_of_drum(Dynamics::projection, 5e-4, 40), heat, 0.05 * heat);
  EXPECT_NEAR(heat_of_drum(Dynamics::projection, 5e-4, 20), heat, 0.05 * heat);
  EXPECT_NEAR(heat_of_drum(Dynamics::spring, 5e-4, 20), heat, 0.05 * heat);
}

}  // namespace
}  // namespace pellicle::sheet_on_bodies_test
