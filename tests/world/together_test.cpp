// Several objects that touch each other: what one presses on another presses back, in one common step.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>

#include "contact/crossings.h"
#include "meshing/closed_shapes.h"
#include "tests/io/files.h"
#include "tests/support/balls.h"
#include "tests/support/by_id.h"
#include "tests/support/csv.h"
#include "tests/support/grid_mesh.h"
#include "tests/world/several_objects.h"
#include "world/group.h"

namespace pellicle::together_test {
namespace {

constexpr double radius = 0.05;  // [m]
constexpr double gap = 2e-3;     // between what is to touch [m]

SurfaceMesh ball_at(const Eigen::Vector3d& centre) { return moved(icosphere_mesh(2, radius), centre); }

void make_balloon(Options& options) {
  options.chain = ChainKind::inflate;
  options.prism.mass_damping = 0;
  options.wall.thickness = 3e-4;
  options.wall.material.law = "neo_hookean";
  options.wall.material.mu = 4e5;
  ChamberOptions& gas = options.chambers["gas"];
  gas.law = "isothermal";
}

void make_touching(Options& options, const std::string& directory) {
  options.force.gravity.setZero();
  options.contact.self = true;
  options.contact.check = true;
  options.contact.thickness = 3e-3;
  options.output.directory = directory;
  options.output.name = "scene";
}

/// What is told of the start.
std::string start_line(const Scene& scene) {
  const std::vector<std::string> lines = scene.world.first_remarks();
  const auto found = std::find_if(lines.begin(), lines.end(), [](const std::string& line) {
    return line.find("pass through each other") != std::string::npos;
  });
  return found == lines.end() ? "" : *found;
}

// The same equations, with other numbers for the vertices.
TEST(Together, TwoBalloonsMoveAsThePiecesOfOneMeshDo) {
  const TestFolder folder;
  const std::array<Eigen::Vector3d, 2> centre{Eigen::Vector3d(-radius - gap / 2, 0, 0),
                                              Eigen::Vector3d(radius + gap / 2, 0.3 * radius, 0)};
  std::deque<NamedOptions> two;
  for (const char* name : {"left", "right"}) {
    Options& options = two.emplace_back(name).options;
    make_balloon(options);
    make_touching(options, folder / "two");
  }
  std::deque<NamedOptions> one;
  make_balloon(one.emplace_back("").options);
  make_touching(one.front().options, folder / "one");
  const SurfaceMesh left = ball_at(centre[0]);
  const auto points = static_cast<PetscInt>(left.points.size());
  Scene objects(std::move(two), {left, ball_at(centre[1])});
  Scene pieces(std::move(one), {joined(left, left, centre[1] - centre[0])});
  objects.throw_all(0, {1, 0, 0});
  for (PetscInt i = 0; i < pieces.object(0).surface().particles.local(); ++i) {
    if (pieces.object(0).surface().persistent_id[i] < points) {
      pieces.object(0).state().velocity.vector(i) = Eigen::Vector3d(1, 0, 0);
    }
  }
  for (int n = 0; n < 12; ++n) {
    objects.step(1e-3);
    pieces.step(1e-3);
    ASSERT_FALSE(::testing::Test::HasFatalFailure());
    EXPECT_EQ(objects.last("crossings"), 0);
  }
  EXPECT_GT(objects.last("contacts"), 0);
  const Eigen::MatrixXd whole = by_id(pieces.object(0).surface(), pieces.object(0).state().position);
  for (std::size_t i = 0; i < 2; ++i) {
    const Eigen::MatrixXd own = by_id(objects.object(i).surface(), objects.object(i).state().position);
    EXPECT_LT((own - whole.middleCols(static_cast<PetscInt>(i) * points, points)).cwiseAbs().maxCoeff(), 1e-8 * radius);
  }
}

class TogetherByDynamics : public ::testing::TestWithParam<Dynamics> {};

INSTANTIATE_TEST_SUITE_P(Each, TogetherByDynamics,
                         ::testing::Values(Dynamics::elastic, Dynamics::projection, Dynamics::spring),
                         [](const auto& info) { return Choice<Dynamics>(info.param).name(); });

// Nothing else acts on them.
TEST_P(TogetherByDynamics, ASheetThatHitsABalloonGivesItItsMomentum) {
  const TestFolder folder;
  std::deque<NamedOptions> objects;
  Options& sheet = objects.emplace_back("sheet").options;
  sheet.dynamics = GetParam();
  sheet.force.damping = 0;
  sheet.sheet.thickness = 2e-3;
  sheet.elastic.newton_tolerance = 1e-6;
  make_touching(sheet, folder / "out");
  Options& balloon = objects.emplace_back("balloon").options;
  make_balloon(balloon);
  make_touching(balloon, folder / "out");
  const SurfaceMesh cloth = moved(grid_mesh(10, 10, 0.01), {-0.05, -0.04, radius + gap});
  Scene scene(std::move(objects), {cloth, ball_at({0, 0, 0})});
  scene.throw_all(0, {0, 0, -1});
  const auto momenta = [&] {
    std::array<Eigen::Vector3d, 2> sums{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
    for (const std::size_t k : {0U, 1U}) {
      for (PetscInt i = 0; i < scene.object(k).surface().particles.owned; ++i) {
        sums[k] += scene.object(k).motion().mass()[i] * scene.object(k).state().velocity.vector(i);
      }
    }
    MPI_Allreduce(MPI_IN_PLACE, sums.data(), 6, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
    return sums;
  };
  const Eigen::Vector3d before = momenta()[0];
  for (int n = 0; n < 12; ++n) {
    scene.step(1e-3);
    ASSERT_FALSE(::testing::Test::HasFatalFailure());
    EXPECT_EQ(scene.last("crossings"), 0);
  }
  EXPECT_GT(scene.last("contacts"), 0);
  const auto after = momenta();
  EXPECT_LT(after[1].z(), 0.05 * before.z());  // It moves down, too.
  EXPECT_LT((after[0] + after[1] - before).norm(), 1e-5 * before.norm());
}

// Beside a balloon that it may touch, it meets the bodies of its own all the same.
TEST_P(TogetherByDynamics, ASheetStaysAboveItsBody) {
  const TestFolder folder;
  std::deque<NamedOptions> objects;
  Options& sheet = objects.emplace_back("sheet").options;
  sheet.dynamics = GetParam();
  make_touching(sheet, folder / "out");
  sheet.bodies["floor"].shape = "plane";
  Options& balloon = objects.emplace_back("balloon").options;
  make_balloon(balloon);
  make_touching(balloon, folder / "out");
  Scene scene(std::move(objects), {moved(grid_mesh(4, 4, 0.02), {0, 0, 0.01}), ball_at({1, 0, 0})});
  scene.throw_all(0, {0, 0, -1});
  for (int n = 0; n < 20; ++n) {
    scene.step(1e-3);
    ASSERT_FALSE(::testing::Test::HasFatalFailure());
    const Field& x = scene.object(0).state().position;
    for (PetscInt i = 0; i < scene.object(0).surface().particles.local(); ++i) {
      EXPECT_GT(x.vector(i).z(), -1e-6);
    }
  }
}

// They come to rest where they begin to press, in the middle between their own thicknesses.
TEST_P(TogetherByDynamics, UnlikeThicknessesCountByTheirMean) {
  const TestFolder folder;
  std::deque<NamedOptions> objects;
  for (const char* name : {"lower", "upper"}) {
    Options& options = objects.emplace_back(name).options;
    options.dynamics = GetParam();
    make_touching(options, folder / "out");
    options.contact.thickness = name == std::string("upper") ? 2e-3 : 6e-3;
  }
  Scene scene(std::move(objects), {grid_mesh(4, 4, 0.02), moved(grid_mesh(5, 5, 0.0173), {0, 0, 0.03})});
  scene.throw_all(1, {0, 0, -0.5});
  double first = 0;  // gap at the first contact
  for (int n = 0; n < 100 && first == 0; ++n) {
    scene.step(1e-3);
    ASSERT_FALSE(::testing::Test::HasFatalFailure());
    first = scene.last("contacts") > 0 ? scene.last("smallest_gap") : 0;
  }
  EXPECT_LT(first, 4e-3);
  EXPECT_GT(first, 3.4e-3) << "a step is half a millimetre";
}

// A sheet of each dynamics on an elastic one on the floor, at rest after a while: the floor bears both.
TEST_P(TogetherByDynamics, TheFloorBearsTheWeightOfAll) {
  const TestFolder folder;
  constexpr double g = 9.81;  // [m/s^2]
  std::deque<NamedOptions> objects;
  for (const char* name : {"lower", "upper"}) {
    Options& options = objects.emplace_back(name).options;
    make_touching(options, folder / "out");
    options.bodies["floor"].shape = "plane";
    options.force.gravity = {0, 0, -g};
    options.force.damping = 5;
    options.sheet.thickness = 5e-3;
    options.elastic.newton_tolerance = 1e-6;
  }
  objects.back().options.dynamics = GetParam();
  Scene scene(std::move(objects),
              {moved(grid_mesh(6, 6, 0.02), {0, 0, 3e-3}), moved(grid_mesh(5, 5, 0.017), {0.01, 0.015, 8e-3})});
  double force = 0;  // on the floor, mean of the last steps
  constexpr int steps = 150;
  constexpr int last = 30;
  for (int n = 0; n < steps; ++n) {
    scene.step(2e-3);
    ASSERT_FALSE(::testing::Test::HasFatalFailure());
    EXPECT_EQ(scene.last("crossings"), 0);
    for (const char* name : {"history_lower.csv", "history_upper.csv"}) {
      force += n >= steps - last ? scene.last("force_floor_z", name) / last : 0;
    }
  }
  EXPECT_GT(scene.last("contacts"), 0);
  double mass = 0;
  for (std::size_t i = 0; i < 2; ++i) {
    const Surface& surface = scene.object(i).surface();
    for (PetscInt p = 0; p < surface.particles.owned; ++p) {
      mass += surface.initial_mass[p];
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, &mass, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
  EXPECT_NEAR(force, -mass * g, 0.01 * mass * g);
}

// Gravity is tilted against a sheet that is constrained, on which another one lies.
TEST_P(TogetherByDynamics, ASheetOnASlopeSticksAndSlides) {
  constexpr double g = 9.81;     // [m/s^2]
  constexpr double slope = 0.5;  // [rad]
  constexpr double h = 2e-3;     // [s]
  constexpr int settles = 40;    // steps
  constexpr int slides = 20;     // steps after that
  for (const double friction : {0.3, 0.8}) {
    const TestFolder folder;
    std::deque<NamedOptions> objects;
    for (const char* name : {"held", "upper"}) {
      Options& options = objects.emplace_back(name).options;
      make_touching(options, folder / "out");
      options.contact.friction = friction;
      options.contact.slip_speed = 1e-3;
      options.force.gravity = Eigen::Vector3d(std::sin(slope), 0, -std::cos(slope)) * g;
      options.force.damping = 0;
      options.sheet.thickness = 4e-3;
      options.elastic.newton_tolerance = 1e-4;
    }
    objects.front().options.pins["all"].box = {-1, -1, -1, 1, 1, 1};
    objects.back().options.dynamics = GetParam();
    // Two thicknesses above: they press from one on.
    const SurfaceMesh upper = moved(grid_mesh(5, 5, 0.012), {0.03, 0.034, 6.1e-3});
    Scene scene(std::move(objects), {grid_mesh(16, 8, 0.017), upper});
    const auto mean_velocity = [&] {
      const Surface& surface = scene.object(1).surface();
      double sum = scene.object(1).state().velocity.values().row(0).leftCols(surface.particles.owned).sum();
      MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
      return sum / static_cast<double>(surface.particles.global);
    };
    double before = 0;
    for (int n = 0; n < settles + slides; ++n) {
      before = n == settles ? mean_velocity() : before;
      scene.step(h);
      ASSERT_FALSE(::testing::Test::HasFatalFailure());
    }
    EXPECT_GT(scene.last("contacts"), 0);
    const double expected = g * (std::sin(slope) - friction * std::cos(slope));
    if (expected > 0) {
      EXPECT_NEAR((mean_velocity() - before) / (slides * h), expected, 0.03 * g) << "friction " << friction;
    } else {
      EXPECT_LT(std::abs(mean_velocity()), 1e-3) << "friction " << friction;
    }
  }
}

/// A sheet round gas, which is blown in, and a cloth that is away from it, or on its way to it.
Scene lantern_and_cloth(const TestFolder& folder, const std::string& name, double distance) {
  std::deque<NamedOptions> objects;
  for (const char* object : {"lantern", "cloth"}) {
    Options& options = objects.emplace_back(object).options;
    make_touching(options, folder / name);
    options.dynamics = Dynamics::elastic;
    options.sheet.thickness = 2e-3;
    options.sheet.areal_density = 0.2;
    options.elastic.newton_tolerance = 1e-6;
  }
  ChamberOptions& gas = objects.front().options.chambers["gas"];
  gas.law = "isothermal";
  gas.amount_ratio = Rows{{0, 1}, {0.012, 1.01}};
  const SurfaceMesh cloth = moved(grid_mesh(6, 6, 0.01), {-0.03, -0.025, distance});
  return {std::move(objects), {quad_ellipsoid_mesh(3, Eigen::Vector3d::Constant(radius)), cloth}};
}

// Whether its pressure is found with the balance of all that touches, or with its own.
TEST(Together, GasInASheetPressesAsItDoesAlone) {
  const TestFolder folder;
  Scene far = lantern_and_cloth(folder, "far", 1);
  std::deque<NamedOptions> alone;
  alone.emplace_back("lantern").options = far.objects.front().options;
  alone.front().options.output.directory = folder / "alone";
  Scene one(std::move(alone), {quad_ellipsoid_mesh(3, Eigen::Vector3d::Constant(radius))});
  for (int n = 0; n < 12; ++n) {
    far.step(1e-3);
    one.step(1e-3);
    ASSERT_FALSE(::testing::Test::HasFatalFailure());
  }
  const Eigen::MatrixXd own = by_id(one.object(0).surface(), one.object(0).state().position);
  const Eigen::MatrixXd beside = by_id(far.object(0).surface(), far.object(0).state().position);
  const Surface& surface = one.object(0).surface();
  EXPECT_GT((own - by_id(surface, surface.rest)).cwiseAbs().maxCoeff(), 1e-4 * radius);
  EXPECT_LT((own - beside).cwiseAbs().maxCoeff(), 1e-6 * radius);
}

TEST(Together, ASheetRoundGasIsPressedIn) {
  const TestFolder folder;
  Scene scene = lantern_and_cloth(folder, "near", radius + gap);
  scene.throw_all(1, {0, 0, -2});
  double contacts = 0;
  for (int n = 0; n < 15; ++n) {
    scene.step(1e-3);
    ASSERT_FALSE(::testing::Test::HasFatalFailure());
    EXPECT_EQ(scene.last("crossings"), 0);
    contacts = std::max(contacts, scene.last("contacts"));
  }
  EXPECT_GT(contacts, 0);
  EXPECT_GT(scene.object(1).state().velocity.values().row(2).maxCoeff(), 0) << "the cloth bounces";
}

/// Two cloths, one of which pokes through the other by a corner.
std::deque<NamedOptions> crossed(const TestFolder& folder, ContactStart start) {
  std::deque<NamedOptions> objects;
  for (const char* name : {"lower", "upper"}) {
    Options& options = objects.emplace_back(name).options;
    make_touching(options, folder / "out");
    options.contact.start = start;
  }
  return objects;
}

std::vector<SurfaceMesh> crossed_meshes() {
  SurfaceMesh lower = grid_mesh(8, 8, 0.01);
  SurfaceMesh upper = grid_mesh(6, 6, 0.01);
  const Eigen::AngleAxisd turn(0.4, Eigen::Vector3d(1, 0.8, 0).normalized());
  for (Eigen::Vector3d& point : upper.points) {
    point = turn * point + Eigen::Vector3d(0.013, 0.017, 4e-3);
  }
  return {lower, upper};
}

TEST(Together, CrossedStartsAreCountedUntangledOrRefused) {
  const TestFolder folder;
  const std::string refusal = error_text([&] { Scene scene(crossed(folder, ContactStart::refuse), crossed_meshes()); });
  for (const char* word : {"contact.start: refuse: ", " pairs of triangles", "lower's", "upper's", "untangle"}) {
    EXPECT_NE(refusal.find(word), std::string::npos) << refusal;
  }
  {
    Scene scene(crossed(folder, ContactStart::accept), crossed_meshes());
    EXPECT_GT(scene.last("crossings"), 0);
    EXPECT_NE(start_line(scene).find("; they are left so"), std::string::npos) << start_line(scene);
  }
  Scene scene(crossed(folder, ContactStart::untangle), crossed_meshes());
  EXPECT_EQ(scene.last("crossings"), 0);
  EXPECT_NE(start_line(scene).find("; untangled, no particle was moved by more than "), std::string::npos)
      << start_line(scene);
  for (const std::size_t k : {0U, 1U}) {
    const Surface& surface = scene.object(k).surface();
    const Eigen::Matrix3Xd moved = scene.object(k).state().position.values() - surface.rest;
    for (PetscInt e = 0; e < surface.elements.owned; ++e) {
      Eigen::Vector3d mean = Eigen::Vector3d::Zero();
      for (const PetscInt corner : surface.cells[e]) {
        mean += moved.col(corner) / 4;
      }
      EXPECT_LT((moved.col(surface.lattice[e]) - mean).norm(), 1e-15) << "a lattice point goes with its corners";
    }
  }
  for (int n = 0; n < 5; ++n) {
    scene.step(1e-3);
    ASSERT_FALSE(::testing::Test::HasFatalFailure());
    EXPECT_EQ(scene.last("crossings"), 0);
  }
  EXPECT_GT(scene.last("smallest_gap"), 0.5 * 3e-3) << "they do not fly apart, nor press hard";
}

// Whether others touch it or not.
TEST(Together, AStartInsideABodyIsNamed) {
  const TestFolder folder;
  for (const bool alone : {true, false}) {
    std::deque<NamedOptions> objects;
    Options& balloon = objects.emplace_back("balloon").options;
    make_balloon(balloon);
    make_touching(balloon, folder / (alone ? "alone" : "two"));
    balloon.bodies["rod"].shape = "cylinder";  // through both of its sides
    balloon.bodies["rod"].axis = {1, 0, 0};
    balloon.bodies["rod"].radius = 0.01;
    std::vector<SurfaceMesh> meshes{ball_at({0, 0, 0})};
    if (!alone) {
      make_touching(objects.emplace_back("cloth").options, folder / "two");
      meshes.push_back(moved(grid_mesh(2, 2, 0.01), {-1, 0, 0}));
    }
    const auto inside =
        std::count_if(meshes[0].points.begin(), meshes[0].points.end(),
                      [](const Eigen::Vector3d& point) { return point.tail<2>().norm() < 0.01 - 3e-4; });
    ASSERT_GT(inside, 0);
    const std::string words = "bodies.rod: " + std::to_string(inside) +
                              " of 162 vertices lie inside it where the step starts, the deepest by ";
    const std::string refusal = error_text([&] { const Scene scene(std::move(objects), meshes); });
    EXPECT_EQ(refusal.find(words), 0U) << refusal << "\n" << words;
  }
}

// A strip that is drawn out below another one. Undeformed, the crack faces of its cracks are in one place.
TEST(Together, LipsOfCracksOpen) {
  const TestFolder folder;
  std::deque<NamedOptions> objects;
  for (const char* name : {"strip", "above"}) {
    Options& options = objects.emplace_back(name).options;
    options.dynamics = Dynamics::elastic;
    options.material.tensile_stiffness = 1000;
    make_touching(options, folder / "out");
  }
  Options& strip = objects.front().options;
  strip.ablation.strength = 20;
  strip.pins["left"].box = {-1, -1, -1, 1e-6, 1, 1};
  strip.pins["right"].box = {0.06 - 1e-6, -1, -1, 1, 1, 1};
  strip.pins["right"].velocity = {1, 0, 0};
  Scene scene(std::move(objects), {grid_mesh(6, 4, 0.01), moved(grid_mesh(6, 4, 0.01), {0, 0, gap})});
  const PetscInt corners = 7 * 5;
  const PetscInt whole = scene.object(0).surface().particles.global;
  for (int n = 0; n < 20 && scene.object(0).surface().particles.global == whole; ++n) {
    scene.step(5e-4);
    ASSERT_FALSE(::testing::Test::HasFatalFailure());
  }
  const Surface& cracked = scene.object(0).surface();
  ASSERT_GT(cracked.particles.global, whole);
  const Eigen::MatrixXd at = by_id(cracked, scene.object(0).state().position);
  const Eigen::MatrixXd rest = by_id(cracked, cracked.rest);
  for (PetscInt copy = whole; copy < cracked.id_end; ++copy) {
    for (PetscInt corner = 0; corner < corners; ++corner) {
      if ((rest.col(copy) - rest.col(corner)).norm() < 1e-9) {
        EXPECT_GT((at.col(copy) - at.col(corner)).norm(), 0.02 * 3e-3);
      }
    }
  }
  EXPECT_EQ(scene.last("crossings"), 0);
}

TEST(Together, WhatCannotGoTogetherIsRefused) {
  std::deque<NamedOptions> objects;
  objects.emplace_back("cloth").options.contact.self = true;
  objects.emplace_back("paper").options.contact.self = true;
  EXPECT_EQ(plan_run(objects).groups.size(), 1U);
  objects[1].options.contact.friction = 0.5;
  EXPECT_EQ(error_text([&] { plan_run(objects); }),
            "paper: contact.friction: 0.5, expected 0 as of cloth, which it touches");
  objects[1].options.contact.self = false;
  EXPECT_EQ(plan_run(objects).groups.size(), 2U);
}

}  // namespace
}  // namespace pellicle::together_test
