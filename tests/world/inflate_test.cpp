// Steps of a balloon whose results are formulas: rigid motions, and an icosahedron that swells and breathes. All its
// vertices are alike, so that its motion has the single unknown s, the ratio of its radius to the undeformed one.

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>

#include "meshing/closed_shapes.h"
#include "tests/io/files.h"
#include "tests/support/balls.h"
#include "tests/support/frames.h"
#include "tests/support/solver_options.h"
#include "tests/world/one_object.h"
#include "tests/world/static_balloon.h"

namespace pellicle::inflate_test {
namespace {

// Of the undeformed icosahedron and its wall.
constexpr double radius = 0.05;     // [m]
constexpr double thickness = 3e-4;  // [m]
const double side = radius / std::sin(2 * M_PI / 5);
const double area = 20 * std::sqrt(3) / 4 * side * side;
const double volume = 5 * (3 + std::sqrt(5)) / 12 * side * side * side;
const double mass = 1000 * thickness * area;

constexpr double h = 5e-3;  // [s]

/// No gravity, no damping, tight solvers.
Options moving_options() {
  Options options;
  options.wall.thickness = thickness;
  options.force.gravity.setZero();
  options.prism.mass_damping = 0;
  options.prism.snes_rtol = 1e-12;
  options.prism.ksp_rtol = 1e-12;
  return options;
}

/// Expects that a balloon has moved as a whole from its undeformed place, and at what velocity.
void expect_moved(const StaticBalloon& balloon, const Eigen::Vector3d& displacement, const Eigen::Vector3d& velocity) {
  for (PetscInt i = 0; i < balloon.membrane().particles.local(); ++i) {
    const Eigen::Vector3d place = balloon.membrane().rest.col(i) + displacement;
    EXPECT_LE((balloon.state().position.vector(i) - place).norm(), 1e-9 * displacement.norm());
    EXPECT_LE((balloon.state().velocity.vector(i) - velocity).norm(), 1e-9 * velocity.norm());
  }
}

/// Options that choose every vertex.
template <class Selection>
Selection everything() {
  Selection selection;
  selection.radius = 2 * radius;
  return selection;
}

TEST(RigidBalloon, FallsFreelyAndTellsTheErrorOfItsSteps) {
  Options options = moving_options();
  const Eigen::Vector3d g(3, -2, -9.81);
  options.force.gravity = g;
  StaticBalloon balloon(icosphere_mesh(0, radius), options);
  for (int step = 1; step <= 3; ++step) {
    const AloneStep result = balloon.step_to(step * h);
    ASSERT_TRUE(result.converged) << result.reason;
    EXPECT_LE(result.newton_iterations, 2);
    // Backward Euler: v = v^n + h g, x = x^n + h v.
    expect_moved(balloon, step * (step + 1) / 2 * h * h * g, step * h * g);
    // |x - x^n - h v^n| / 2, over the square root of the area.
    EXPECT_NEAR(*result.error, h * h * g.norm() / 2 / std::sqrt(area), 1e-8 * *result.error);
  }
}

TEST(RigidBalloon, FlysOnAndIsBrakedByItsDamping) {
  const Eigen::Vector3d speed(1, 2, -0.5);
  for (const double damping : {0.0, 30.0}) {
    Options options = moving_options();
    options.prism.mass_damping = damping;
    StaticBalloon balloon(icosphere_mesh(0, radius), options);
    balloon.state().velocity.values().colwise() = speed;
    balloon.reach(h);
    const Eigen::Vector3d left = speed / (1 + damping * h);
    expect_moved(balloon, h * left, left);
  }
}

TEST(RigidBalloon, IsPushedByForcesAndPulledByAttachments) {
  Options options = moving_options();
  auto push = everything<PushOptions>();
  push.force = {{0, 0, 0, 0}, {2 * h, 0.2, -0.4, 0.1}};
  options.forces["wind"] = push;
  StaticBalloon pushed(icosphere_mesh(0, radius), options);
  pushed.reach(h);
  const Eigen::Vector3d speed = h * Eigen::Vector3d(0.1, -0.2, 0.05) / mass;
  expect_moved(pushed, h * speed, speed);

  options.forces.clear();
  auto attachment = everything<AttachmentOptions>();
  attachment.total_stiffness = 700;
  attachment.path = {{0, 0, 0, 0}, {2 * h, 0.02, 0.01, 0.03}};
  options.attachments["hands"] = attachment;
  StaticBalloon pulled(icosphere_mesh(0, radius), options);
  pulled.reach(h);
  const Eigen::Vector3d displacement = 700 / (mass / (h * h) + 700) * Eigen::Vector3d(0.01, 0.005, 0.015);
  expect_moved(pulled, displacement, displacement / h);
}

TEST(Balloon, BeginsWithItsNoiseWhereItMayMoveAndItsGas) {
  Options options;
  options.sheet.perturbation = 0.1;
  options.symmetry["ground"].normal = {0, 0, 2};
  options.pins["top"].radius = 1e-3;
  options.pins["top"].centre = {0, 0, radius};
  options.pins["top"].path = {{0, 0, 0, 0.01}};
  options.chambers["gas"].law = "isothermal";
  options.chambers["gas"].amount_ratio = {{0, 1.1}};
  const StaticBalloon balloon(dome_mesh(2, radius), options);
  const Membrane& membrane = balloon.membrane();
  double largest = 0;
  for (PetscInt i = 0; i < membrane.particles.local(); ++i) {
    const Eigen::Vector3d place = membrane.rest.col(i);
    const Eigen::Vector3d noise = balloon.state().position.vector(i) - place;
    if ((place - Eigen::Vector3d(0, 0, radius)).norm() < 1e-6) {
      EXPECT_LE((noise - Eigen::Vector3d(0, 0, 0.01)).norm(), 1e-15);
    } else {
      largest = std::max(largest, noise.norm());
      EXPECT_TRUE(place.z() > 1e-6 || noise.z() == 0) << noise.transpose();
    }
  }
  EXPECT_TRUE(membrane.particles.local() == 0 || largest > 1e-5);
  for (std::size_t e = 0; e < membrane.triangles.size(); ++e) {
    const auto area_of = [&](const auto& place) {
      const auto& [a, b, c] = membrane.triangles[e];
      return Eigen::Vector3d(place(b) - place(a)).cross(Eigen::Vector3d(place(c) - place(a))).norm();
    };
    const double before = area_of([&](PetscInt i) { return Eigen::Vector3d(membrane.rest.col(i)); });
    const double now = area_of([&](PetscInt i) { return Eigen::Vector3d(balloon.state().position.vector(i)); });
    EXPECT_NEAR(balloon.state().thickness_ratio[e], before / now, 1e-12);
  }
  const double v = balloon.volume() / balloon.chambers().initial_volume(0);
  EXPECT_GT(std::abs(v - 1), 1e-4);
  EXPECT_NEAR(balloon.pressure(), 101325 * (1.1 / v - 1), 1e-6);
}

/// The elastic energy per undeformed volume of a wall stretched by s in both directions, and its derivatives by s.
struct Rubber {
  const char* name;
  std::function<void(WallOptions&)> set;
  std::function<double(double)> slope;
  std::function<double(double)> curvature;
};

std::vector<Rubber> rubbers() {
  const auto power = [](double s, double exponent) { return std::pow(s, exponent); };
  return {
      {"neo_hookean", [](WallOptions& wall) { wall.material.mu = 4e5; },
       // mu/2 (2 s^2 + s^-4 - 3)
       [power](double s) { return 4e5 * (2 * s - 2 * power(s, -5)); },
       [power](double s) { return 4e5 * (2 + 10 * power(s, -6)); }},
      {"mooney_rivlin",
       [](WallOptions& wall) {
         wall.material.c1 = 2e5;
         wall.material.c2 = 3e4;
       },
       // c1 (2 s^2 + s^-4 - 3) + c2 (s^4 + 2 s^-2 - 3)
       [power](double s) { return 2e5 * (4 * s - 4 * power(s, -5)) + 3e4 * (4 * power(s, 3) - 4 * power(s, -3)); },
       [power](double s) { return 2e5 * (4 + 20 * power(s, -6)) + 3e4 * (12 * s * s + 12 * power(s, -4)); }},
      {"ogden",
       [](WallOptions& wall) {
         wall.material.ogden_mu = {6e5, -2e4};
         wall.material.ogden_alpha = {1.5, -2};
       },
       // sum mu/alpha (2 s^alpha + s^(-2 alpha) - 3)
       [power](double s) { return 2 * 6e5 * (power(s, 0.5) - power(s, -4)) - 2 * 2e4 * (power(s, -3) - power(s, 3)); },
       [power](double s) {
         return 2 * 6e5 * (0.5 * power(s, -0.5) + 4 * power(s, -5)) - 2 * 2e4 * (-3 * power(s, -4) - 3 * s * s);
       }},
      {"st_venant_kirchhoff",
       [](WallOptions& wall) {
         wall.thickness_rule = "fixed";
         wall.material.mu = 4e5;
         wall.material.lambda = 2e5;
       },
       // 2 (mu + lambda) e^2 with e = (s^2 - 1)/2
       [](double s) { return 2 * 6e5 * (s * s - 1) * s; }, [](double s) { return 2 * 6e5 * (3 * s * s - 1); }},
  };
}

/// A gas and its gauge pressure at a time and a volume that is v times the undeformed one; none: the volume is given.
struct Gas {
  const char* law;
  std::function<void(ChamberOptions&)> set;
  std::function<double(double time, double v)> pressure;
};

constexpr double ambient = 101325;  // [Pa]
constexpr double end = 8 * h;       // [s]

std::vector<Gas> gases() {
  return {
      {"relative",
       [](ChamberOptions& gas) {
         gas.pressure = {{0, 0}, {end, 12000}};
       },
       [](double time, double v) { return 12000 * time / end / v; }},
      {"pressure",
       [](ChamberOptions& gas) {
         gas.pressure = {{0, 0}, {end, 2000}};
       },
       [](double time, double) { return 2000 * time / end; }},
      {"isothermal",
       [](ChamberOptions& gas) {
         gas.amount_ratio = {{0, 1}, {end, 1.5}};
         gas.temperature = {{0, 300}, {end, 360}};
       },
       [](double time, double v) { return ambient * (1 + 0.5 * time / end) * (1 + 0.2 * time / end) / v - ambient; }},
      {"adiabatic",
       [](ChamberOptions& gas) {
         gas.amount_ratio = {{0, 1}, {end, 1.5}};
         gas.gamma = 1.3;
       },
       [](double time, double v) { return ambient * (1 + 0.5 * time / end) * std::pow(v, -1.3) - ambient; }},
      {"volume",
       [](ChamberOptions& gas) {
         gas.volume_ratio = {{0, 1}, {end, 1.6}};
       },
       nullptr}};
}

constexpr double mass_damping = 15;         // [1/s]
constexpr double stiffness_damping = 2e-3;  // [s]

/// The zero of a function that rises, between two values.
double zero_of(const std::function<double(double)>& rising, double low, double high) {
  for (int k = 0; k < 100; ++k) {
    const double middle = (low + high) / 2;
    (rising(middle) < 0 ? low : high) = middle;
  }
  return (low + high) / 2;
}

class Icosahedron : public ::testing::TestWithParam<std::size_t> {};
INSTANTIATE_TEST_SUITE_P(Rubbers, Icosahedron, ::testing::Range(std::size_t{0}, rubbers().size()),
                         [](const auto& info) { return rubbers()[info.param].name; });

TEST_P(Icosahedron, MovesAsItsOneUnknown) {
  if (ranks() > 1) {
    GTEST_SKIP() << "on one rank only";
  }
  const Rubber rubber = rubbers()[GetParam()];
  for (const Gas& gas : gases()) {
    Options options = moving_options();
    options.wall.bending = "none";  // which the force of the one unknown leaves out
    options.wall.material.law = rubber.name;
    rubber.set(options.wall);
    options.prism.mass_damping = mass_damping;
    options.prism.stiffness_damping = stiffness_damping;
    options.chambers["gas"].law = gas.law;
    gas.set(options.chambers["gas"]);
    StaticBalloon balloon(icosphere_mesh(0, radius), options);
    const double inertia = mass * radius * radius;  // of s
    double s = 1;
    double speed = 0;
    for (int step = 1; step <= 8; ++step) {
      const double time = step * h;
      // The force that all but the gas leaves over, eq. 18 with C = mass_damping M + stiffness_damping K(x^n).
      const double damping = mass_damping * inertia + stiffness_damping * area * thickness * rubber.curvature(s);
      const auto resistance = [&](double next) {
        return inertia * (next - s - h * speed) / (h * h) + damping * (next - s) / h +
               area * thickness * rubber.slope(next);
      };
      const auto dvolume = [](double next) { return 3 * volume * next * next; };
      const double next =
          gas.pressure
              ? zero_of([&](double at) { return resistance(at) - gas.pressure(time, at * at * at) * dvolume(at); },
                        0.9 * s, 1.2 * s)
              : std::cbrt(1 + 0.6 * time / end);
      const double pressure = resistance(next) / dvolume(next);
      const AloneStep result = balloon.step_to(time);
      ASSERT_TRUE(result.converged) << gas.law << ": " << result.reason;
      EXPECT_LE(result.newton_iterations, 8) << gas.law;
      const double step_error = std::abs(next - s - h * speed) * radius / 2 / std::sqrt(area);
      EXPECT_NEAR(*result.error, step_error, 1e-7 * step_error) << gas.law;
      speed = (next - s) / h;
      s = next;
      EXPECT_NEAR(balloon.pressure(), pressure, 1e-6 * pressure) << gas.law << " step " << step;
      for (PetscInt i = 0; i < balloon.membrane().particles.local(); ++i) {
        const Eigen::Vector3d place = s * balloon.membrane().rest.col(i);
        EXPECT_LE((balloon.state().position.vector(i) - place).norm(), 1e-9 * radius) << gas.law << " step " << step;
      }
    }
    EXPECT_GT(s, 1.05) << gas.law;
  }
}

TEST_P(Icosahedron, IsDrawnAsItIs) {
  const TestFolder folder;
  const Rubber rubber = rubbers()[GetParam()];
  Options options = moving_options();
  options.wall.material.law = rubber.name;
  rubber.set(options.wall);
  options.chambers["gas"].law = "volume";
  options.chambers["gas"].volume_ratio = {{0, 1}, {2 * h, 1.331}};
  options.output.directory = folder / "out";
  options.output.name = "ball";
  OneObject run(icosphere_mesh(0, radius), options, ChainKind::inflate);
  ASSERT_TRUE(run.advance(h).converged);
  ASSERT_TRUE(run.advance(h).converged);
  run.draw();
  MPI_Barrier(PETSC_COMM_WORLD);
  const DrawnFrame frame = last_frame(folder / "out/ball.pvd");
  EXPECT_DOUBLE_EQ(frame.time, 2 * h);
  const double s = 1.1;
  const double before = std::cbrt(1.1655);
  for (const auto& [id, place] : frame.points.at("position")) {
    const auto as_vector = [](const std::vector<double>& values) { return Eigen::Vector3d(values.data()); };
    const Eigen::Vector3d outward = as_vector(place).normalized();
    EXPECT_NEAR(as_vector(place).norm(), s * radius, 1e-7);
    const Eigen::Vector3d velocity = (s - before) * radius / h * outward;
    EXPECT_LE((as_vector(frame.points.at("velocity").at(id)) - velocity).norm(), 1e-5 * velocity.norm());
  }
  EXPECT_EQ(frame.points.at("position").size(), 12U);
  const bool is_fixed = options.wall.thickness_rule == WallThickness::fixed;
  const double ratio = is_fixed ? 1 : 1 / (s * s);
  // Cauchy's stress times the present volume does the work of the energy per undeformed volume.
  const double stress = s * rubber.slope(s) / 2 / (is_fixed ? s * s : 1);
  EXPECT_EQ(frame.cell_values.at("thickness").size(), 20U);
  for (const auto& [id, thickness_here] : frame.cell_values.at("thickness")) {
    EXPECT_NEAR(thickness_here[0], thickness * ratio, 1e-6 * thickness);
    EXPECT_NEAR(frame.cell_values.at("thickness_ratio").at(id)[0], ratio, 1e-6);
    for (const std::size_t direction : {0U, 1U}) {
      EXPECT_NEAR(frame.cell_values.at("stretch").at(id)[direction], s, 1e-6);
      EXPECT_NEAR(frame.cell_values.at("stress").at(id)[direction], stress, 1e-5 * stress);
    }
  }
}

}  // namespace
}  // namespace pellicle::inflate_test
