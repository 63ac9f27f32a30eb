// Balloons that ring, fly and spin by generalized alpha, against what they do without any step: the differential
// equation of a sphere's radius, and what is conserved.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "geometry/pi.h"
#include "meshing/closed_shapes.h"
#include "run/step_control.h"
#include "tests/io/files.h"
#include "tests/support/balls.h"
#include "tests/support/csv.h"
#include "tests/support/print_once.h"
#include "tests/support/solver_options.h"
#include "tests/world/one_object.h"
#include "tests/world/static_balloon.h"

namespace pellicle::ringing_balloon_test {
namespace {

constexpr double radius = 0.1;        // R [m]
constexpr double thickness = 3e-4;    // h [m]
constexpr double density = 1000;      // [kg/m^3]
constexpr double mu = 4e5;            // [Pa]
constexpr double filling = 4437.512;  // p0 [Pa]: at rest at three times the volume

Options ringing_options() {
  Options options;
  options.chain = ChainKind::inflate;
  options.time.scheme = TimeScheme::generalized_alpha;
  options.wall.thickness = thickness;
  options.wall.density = density;
  options.wall.material.mu = mu;
  options.force.gravity.setZero();
  options.prism.mass_damping = 0;
  options.prism.snes_rtol = 1e-11;
  options.prism.ksp_rtol = 1e-11;
  return options;
}

Options with_gas(Options options) {
  options.chambers["gas"].law = "relative";
  options.chambers["gas"].pressure = {{0, filling}};
  return options;
}

/// Radius over that at rest, s, and its rate: the solution of s'' = f(t, s, s').
class Radius {
 public:
  using Law = std::function<double(double time, double s, double rate)>;
  explicit Radius(Law law) : law_(std::move(law)) {}

  double s() const { return s_; }
  double rate() const { return rate_; }
  double time() const { return time_; }

  /// By the classical Runge-Kutta method, with steps of 1 us: to 1e-11.
  void go_to(double time) {
    const int steps = std::max(1, static_cast<int>(std::ceil((time - time_) / 1e-6)));
    const double h = (time - time_) / steps;
    for (int k = 0; k < steps; ++k) {
      const auto slope = [&](double at, double s, double rate) { return Eigen::Vector2d(rate, law_(at, s, rate)); };
      const Eigen::Vector2d state(s_, rate_);
      const Eigen::Vector2d a = slope(time_, s_, rate_);
      const Eigen::Vector2d b = slope(time_ + h / 2, s_ + h / 2 * a[0], rate_ + h / 2 * a[1]);
      const Eigen::Vector2d c = slope(time_ + h / 2, s_ + h / 2 * b[0], rate_ + h / 2 * b[1]);
      const Eigen::Vector2d d = slope(time_ + h, s_ + h * c[0], rate_ + h * c[1]);
      const Eigen::Vector2d next = state + h / 6 * (a + 2 * b + 2 * c + d);
      s_ = next[0];
      rate_ = next[1];
      time_ += h;
    }
    time_ = time;
  }

 private:
  Law law_;
  double time_ = 0;
  double s_ = 1;
  double rate_ = 0;
};

/// A sphere of neo-Hookean rubber in the paper's gas: rho R^2 s'' = p0 R/(h s) - 2 mu (s - s^-5).
double of_sphere(double s) {
  return (filling * radius / thickness / s - 2 * mu * (s - std::pow(s, -5))) / (density * radius * radius);
}

struct Peak {
  double time;
  double volume;  ///< over the undeformed one
};

/// The highest points between neighbouring values: by the parabola through three.
std::vector<Peak> peaks_of(const std::vector<Peak>& course) {
  std::vector<Peak> peaks;
  for (std::size_t k = 1; k + 1 < course.size(); ++k) {
    const auto& [time, volume] = course[k];
    const double h = time - course[k - 1].time;
    if (volume >= course[k - 1].volume && volume > course[k + 1].volume) {
      const double slope = (course[k + 1].volume - course[k - 1].volume) / (2 * h);
      const double curvature = (course[k + 1].volume - 2 * volume + course[k - 1].volume) / (h * h);
      peaks.push_back({time - slope / curvature, volume - slope * slope / (2 * curvature)});
    }
  }
  return peaks;
}

TEST(RingingBalloon, KeepsItsPeriodAndItsAmplitude) {
  Radius exact([](double, double s, double) { return of_sphere(s); });
  std::vector<Peak> course{{0, 1}};
  while (course.size() < 1600) {
    exact.go_to(1e-4 * static_cast<double>(course.size()));
    course.push_back({exact.time(), std::pow(exact.s(), 3)});
  }
  const std::vector<Peak> expected = peaks_of(course);
  ASSERT_EQ(expected.size(), 12U);
  const double period = (expected[10].time - expected[0].time) / 10;
  const double highest = expected[0].volume;
  EXPECT_NEAR(period, 13.747e-3, 1e-6);
  EXPECT_NEAR(highest, 8.183, 1e-3);

  constexpr double h = 5e-4;
  Options options = with_gas(ringing_options());
  options.prism.snes_rtol = 1e-6;
  options.prism.ksp_rtol = 1e-6;
  StaticBalloon balloon(icosphere_mesh(3, radius), options);
  const double undeformed = balloon.volume();
  course = {{0, 1}};
  for (int step = 1; step <= 300; ++step) {
    balloon.reach(step * h);
    course.push_back({balloon.state().time, balloon.volume() / undeformed});
  }
  const std::vector<Peak> peaks = peaks_of(course);
  ASSERT_EQ(peaks.size(), 11U);
  const double got = (peaks[10].time - peaks[0].time) / 10;
  print_once("period %.3f ms (%.3f), first peak %.3f V0 (%.3f), tenth %.3f V0\n", 1e3 * got, 1e3 * period,
             peaks[0].volume, highest, peaks[9].volume);
  EXPECT_NEAR(got, period, 0.01 * period);
  for (const Peak& peak : peaks) {
    EXPECT_NEAR(peak.volume, highest, 0.02 * highest);
  }
}

// An icosahedron, all of whose vertices are alike: its radius has the same kind of equation, without an error of the
// mesh. With damping, of which K changes from step to step, and gas pumped in.
class Icosahedron : public ::testing::Test {
 protected:
  const double side_ = radius / std::sin(2 * pi / 5);
  const double area_ = 20 * std::sqrt(3) / 4 * side_ * side_;
  const double volume_ = 5 * (3 + std::sqrt(5)) / 12 * side_ * side_ * side_;
  const double wall_ = area_ * thickness;  // [m^3]
  static constexpr double end_ = 5e-3;     // [s]
  static constexpr double mass_damping_ = 15;
  static constexpr double stiffness_damping_ = 3e-4;

  static Options damped_options() {
    Options options = ringing_options();
    options.prism.mass_damping = mass_damping_;
    options.prism.stiffness_damping = stiffness_damping_;
    options.chambers["gas"].law = "isothermal";
    options.chambers["gas"].amount_ratio = {{0, 1.05}, {2 * end_, 1.35}};
    return options;
  }

  double inertia() const { return density * wall_ * radius * radius; }

  /// s'' of it.
  double damped(double time, double s, double rate) const {
    const double slope = mu * (2 * s - 2 * std::pow(s, -5));
    const double curvature = mu * (2 + 10 * std::pow(s, -6));
    const double pressure = 101325 * ((1.05 + 0.3 * time / (2 * end_)) / std::pow(s, 3) - 1);
    return (pressure * 3 * volume_ * s * s - wall_ * slope -
            (mass_damping_ * inertia() + stiffness_damping_ * wall_ * curvature) * rate) /
           inertia();
  }
  double undamped(double s) const {
    return (filling * 3 * volume_ / s - wall_ * mu * (2 * s - 2 * std::pow(s, -5))) / inertia();
  }

  /// Largest error of s at the end, and of its rate.
  static std::array<double, 2> errors(const State& state, const Membrane& membrane, const Radius& exact) {
    std::array<double, 2> error{0, 0};
    for (PetscInt i = 0; i < membrane.particles.local(); ++i) {
      const Eigen::Vector3d rest = membrane.rest.col(i);
      error[0] = std::max(error[0], (state.position.vector(i) - exact.s() * rest).norm() / radius);
      error[1] = std::max(error[1], (state.velocity.vector(i) - exact.rate() * rest).norm() / radius);
    }
    MPI_Allreduce(MPI_IN_PLACE, error.data(), 2, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD);
    return error;
  }
};

TEST_F(Icosahedron, ConvergesWithTheSquareOfTheStep) {
  Radius exact([this](double time, double s, double rate) { return damped(time, s, rate); });
  exact.go_to(end_);
  for (const double spectral_radius : {0.5, 0.8, 1.0}) {
    Options options = damped_options();
    options.time.spectral_radius = spectral_radius;
    std::array<double, 2> last{};
    for (const int steps : {100, 200, 400}) {
      StaticBalloon balloon(icosphere_mesh(0, radius), options);
      balloon.reach(end_, steps);
      const std::array<double, 2> error = errors(balloon.state(), balloon.membrane(), exact);
      print_once("spectral radius %.1f, %d steps: s to %.1e, rate to %.1e/s\n", spectral_radius, steps, error[0],
                 error[1]);
      for (const std::size_t k : {0U, 1U}) {
        if (steps > 200) {
          EXPECT_NEAR(std::log2(last[k] / error[k]), 2, 0.15) << spectral_radius;
        }
      }
      last = error;
    }
    EXPECT_LT(last[0], 5e-4);
  }
  EXPECT_GT(exact.s(), 1.05);
}

TEST_F(Icosahedron, ItsErrorFollowsTheTolerance) {
  Radius exact([this](double, double s, double) { return undamped(s); });
  exact.go_to(0.02);
  std::vector<double> error;
  std::vector<double> steps;
  for (const double tolerance : {1e-5, 1e-8}) {
    const TestFolder folder;
    Options options = with_gas(ringing_options());
    options.time.step = 2e-5;
    options.time.max_step = 5e-3;
    options.time.end = 0.02;
    options.time.tolerance = tolerance;
    options.output.directory = folder / "out";
    options.output.name = "ball";
    options.output.interval_time = 1;
    OneObject run(icosphere_mesh(0, radius), options, ChainKind::inflate);
    run.begin();
    run_steps(run, options.time, run.console());
    error.push_back(errors(run.state(), run.membrane(), exact)[0]);
    steps.push_back(run.step());
    print_once("tolerance %.0e: %d steps, s to %.1e\n", tolerance, run.step(), error.back());
  }
  // A step's error goes with h^3: steps with the third root of the tolerance, their sum with the square of that.
  EXPECT_NEAR(steps[1] / steps[0], 10, 1.5);
  EXPECT_GT(error[0] / error[1], 50);
  EXPECT_LT(error[0] / error[1], 200);
}

/// The sum of masses times places [kg m].
Eigen::Vector3d moment_of_mass(const StaticBalloon& balloon) {
  return balloon.sum_of_vectors([&](PetscInt i) -> Eigen::Vector3d {
    return balloon.object.motion().mass()[i] * balloon.state().position.vector(i);
  });
}
Eigen::Vector3d angular_momentum(const StaticBalloon& balloon) {
  return balloon.sum_of_vectors([&](PetscInt i) -> Eigen::Vector3d {
    const Eigen::Vector3d velocity = balloon.state().velocity.vector(i);
    return balloon.object.motion().mass()[i] * Eigen::Vector3d(balloon.state().position.vector(i)).cross(velocity);
  });
}

// A ball that spins and flies while it rings: its momentum stays, its angular momentum, too, by the midpoint rule, and
// otherwise to an error that goes with the step's square at least.
TEST(SpinningBalloon, KeepsItsMomentumAndItsAngularMomentum) {
  const Eigen::Vector3d spin(20, 30, 100);  // [1/s]
  const Eigen::Vector3d flight(1, -2, 3);   // [m/s]
  const auto lost = [&](double spectral_radius, double h) {
    Options options = with_gas(ringing_options());
    options.time.spectral_radius = spectral_radius;
    SurfaceMesh mesh = icosphere_mesh(1, radius);
    for (Eigen::Vector3d& point : mesh.points) {
      point.z() *= 1.3;
    }
    StaticBalloon balloon(mesh, options);
    for (PetscInt i = 0; i < balloon.membrane().particles.local(); ++i) {
      balloon.state().velocity.vector(i) = flight + spin.cross(Eigen::Vector3d(balloon.state().position.vector(i)));
    }
    const Eigen::Vector3d p = balloon.momentum();
    const Eigen::Vector3d l = angular_momentum(balloon);
    for (int step = 1; step * h < 0.0201; ++step) {
      balloon.reach(step * h);
    }
    EXPECT_LE((balloon.momentum() - p).norm(), 1e-9 * p.norm());
    return (angular_momentum(balloon) - l).norm() / l.norm();
  };
  EXPECT_LE(lost(1, 1e-3), 1e-9);
  const double coarse = lost(0.8, 1e-3);
  const double fine = lost(0.8, 5e-4);
  print_once("angular momentum: %.1e lost by 1 ms, %.1e by 0.5 ms\n", coarse, fine);
  EXPECT_LT(coarse, 0.02);
  EXPECT_GT(coarse / fine, 3.5);
}

TEST(RigidBalloonByGeneralizedAlpha, FallsExactlyWhateverTheSteps) {
  Options options = ringing_options();
  const Eigen::Vector3d g(3, -2, -9.81);
  options.force.gravity = g;
  StaticBalloon balloon(icosphere_mesh(0, radius), options);
  const Eigen::Vector3d speed(1, 2, -0.5);
  balloon.state().velocity.values().colwise() = speed;
  for (const double time : {0.01, 0.013, 0.1, 0.102}) {
    const AloneStep result = balloon.step_to(time);
    ASSERT_TRUE(result.converged) << result.reason;
    EXPECT_LE(*result.error, 1e-9 * g.norm() * time * time);
    for (PetscInt i = 0; i < balloon.membrane().particles.local(); ++i) {
      const Eigen::Vector3d place = balloon.membrane().rest.col(i) + time * speed + time * time / 2 * g;
      EXPECT_LE((balloon.state().position.vector(i) - place).norm(), 1e-11);
      EXPECT_LE((balloon.state().velocity.vector(i) - speed - time * g).norm(), 1e-9);
    }
  }
}

/// The error of a rigid balloon's place at the end, for a run in so many steps. @param expected displacement then
double error_of_place(const Options& options, double end, int steps, const Eigen::Vector3d& speed,
                      const Eigen::Vector3d& expected) {
  StaticBalloon balloon(icosphere_mesh(0, radius), options);
  balloon.state().velocity.values().colwise() = speed;
  balloon.reach(end, steps);
  double error = 0;
  for (PetscInt i = 0; i < balloon.membrane().particles.local(); ++i) {
    const Eigen::Vector3d place = balloon.membrane().rest.col(i) + expected;
    error = std::max(error, (balloon.state().position.vector(i) - place).norm());
  }
  MPI_Allreduce(MPI_IN_PLACE, &error, 1, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD);
  return error;
}

TEST(RigidBalloonByGeneralizedAlpha, FollowsAMovingAttachmentToSecondOrder) {
  Options options = ringing_options();
  AttachmentOptions& hands = options.attachments["hands"];
  hands.radius = 2 * radius;
  hands.total_stiffness = 700;
  hands.velocity = {0.4, 0, 0.3};
  StaticBalloon balloon(icosphere_mesh(0, radius), options);
  const double frequency = std::sqrt(700 / balloon.mass());
  constexpr double end = 0.02;
  const Eigen::Vector3d place = (end - std::sin(frequency * end) / frequency) * hands.velocity;
  const double coarse = error_of_place(options, end, 40, {0, 0, 0}, place);
  const double fine = error_of_place(options, end, 80, {0, 0, 0}, place);
  print_once("attachment: %.1e m in 40 steps, %.1e m in 80\n", coarse, fine);
  EXPECT_LT(coarse, 0.05 * place.norm());
  EXPECT_NEAR(std::log2(coarse / fine), 2, 0.1);
}

// In still air a plate's drag goes with the square of its speed; a ball's velocity stays parallel: v' = -b |v| v.
TEST(RigidBalloonByGeneralizedAlpha, IsBrakedByTheAirToSecondOrder) {
  Options options = ringing_options();
  options.force.air.density = 40;
  const Eigen::Vector3d speed(0, 0, -4);
  constexpr double end = 0.05;
  options.wall.material.mu = 4e8;  // that it stays as it is
  const auto place = [&](int steps) {
    StaticBalloon balloon(icosphere_mesh(1, radius), options);
    balloon.state().velocity.values().colwise() = speed;
    balloon.reach(end, steps);
    return moment_of_mass(balloon);
  };
  const double first = (place(20) - place(40)).norm();
  const double second = (place(40) - place(80)).norm();
  print_once("air: %.2e and %.2e kg m\n", first, second);
  EXPECT_NEAR(std::log2(first / second), 2, 0.3);
}

TEST(BalloonByGeneralizedAlpha, LedVerticesAreInTheirPlaces) {
  Options options = with_gas(ringing_options());
  options.pins["top"].centre = {0, 0, radius};
  options.pins["top"].radius = 0.3 * radius;
  options.pins["top"].path = {{0, 0, 0, 0}, {1e-3, 0, 0.001, 0.002}, {3e-3, 0.002, 0, 0}};
  options.symmetry["middle"].normal = {1, 0, 0};
  StaticBalloon balloon(icosphere_mesh(2, radius), options);
  const std::vector<Eigen::Vector3d> places{{0, 0.0005, 0.001}, {0, 0.001, 0.002}, {0.0005, 0.00075, 0.0015}};
  Eigen::Vector3d before(0, 0, 0);
  for (std::size_t step = 0; step < places.size(); ++step) {
    balloon.reach(5e-4 * static_cast<double>(step + 1));
    const Eigen::Vector3d velocity = (places[step] - before) / 5e-4;
    before = places[step];
    for (PetscInt i = 0; i < balloon.membrane().particles.local(); ++i) {
      const Eigen::Vector3d rest = balloon.membrane().rest.col(i);
      if ((rest - Eigen::Vector3d(0, 0, radius)).norm() < 0.3 * radius) {
        EXPECT_LE((balloon.state().position.vector(i) - rest - places[step]).norm(), 1e-15);
        EXPECT_LE((balloon.state().velocity.vector(i) - velocity).norm(), 1e-10);
      } else if (std::abs(rest.x()) < 1e-9) {
        EXPECT_LE(std::abs(balloon.state().position.vector(i).x() - rest.x()), 1e-15);
      }
    }
  }
}

// Stiffness damping acts on the rate of strain. There is none where all vertices move alike, those that pins lead and
// the others.
TEST(BalloonByGeneralizedAlpha, GoesAlongWithItsPinsThoughItIsDamped) {
  Options options = ringing_options();
  options.prism.stiffness_damping = 1e-2;
  const Eigen::Vector3d speed(1, 2, -0.5);
  options.pins["top"].centre = {0, 0, radius};
  options.pins["top"].radius = 0.6 * radius;
  options.pins["top"].velocity = speed;
  StaticBalloon balloon(icosphere_mesh(2, radius), options);
  balloon.state().velocity.values().colwise() = speed;
  for (int step = 1; step <= 4; ++step) {
    const double time = 1e-3 * step;
    balloon.reach(time);
    for (PetscInt i = 0; i < balloon.membrane().particles.local(); ++i) {
      const Eigen::Vector3d place = balloon.membrane().rest.col(i) + time * speed;
      EXPECT_LE((balloon.state().position.vector(i) - place).norm(), 1e-11);
    }
  }
}

// A plate comes down on a ball and drives it off: where it is then, by steps of 0.5 ms and by very short ones of
// implicit Euler.
TEST(BalloonByGeneralizedAlpha, IsPressedByAMovingBody) {
  const auto height = [](TimeScheme scheme, double h) {
    Options options = with_gas(ringing_options());
    options.time.scheme = scheme;
    options.prism.mass_damping = 100;
    options.contact.stiffness = 1e6;
    options.contact.thickness = 0.02;  // so soft that steps of 0.5 ms resolve it
    BodyOptions& plate = options.bodies["plate"];
    plate.shape = "plane";
    plate.point = {0, 0, radius + 0.02};
    plate.normal = {0, 0, -1};
    plate.velocity = {0, 0, -2};
    StaticBalloon balloon(icosphere_mesh(1, radius), options);
    for (int step = 1; step * h < 0.02001; ++step) {
      balloon.reach(step * h);
    }
    return moment_of_mass(balloon).z() / balloon.mass();
  };
  const double exact = height(TimeScheme::implicit_euler, 5e-6);
  const double by_alpha = height(TimeScheme::generalized_alpha, 5e-4);
  const double by_euler = height(TimeScheme::implicit_euler, 5e-4);
  print_once("pressed down to %.4f m; by steps of 0.5 ms to %.4f m, implicit Euler %.4f m\n", exact, by_alpha,
             by_euler);
  EXPECT_LT(exact, -0.3 * radius);
  EXPECT_NEAR(by_alpha, exact, 0.02 * std::abs(exact));
}

TEST(BalloonByGeneralizedAlpha, SaysWhatItDoesNotGoWith) {
  const std::vector<std::pair<std::string, std::function<void(Options&)>>> cases{
      {"prism.inertia: false", [](Options& options) { options.prism.inertia = false; }},
      {"heats, burns or tears", [](Options& options) { options.heat.convection = 10; }},
      {"prism.thickness: global", [](Options& options) { options.wall.thickness_rule = WallThickness::global_volume; }},
      {"chambers.NAME.law: volume", [](Options& options) {
         options.chambers["gas"].law = "volume";
         options.chambers["gas"].pressure.clear();
         options.chambers["gas"].volume_ratio = {{0, 1}};
       }}};
  for (const auto& [words, change] : cases) {
    ObjectOptions object("");
    object.options = with_gas(ringing_options());
    object.options.chain = ChainKind::inflate;
    change(object.options);
    const std::string error = error_text([&] { object.table.check_exclusions(); });
    for (const std::string& part : {std::string("time.scheme: generalized_alpha does not go with"), words,
                                    std::string("expected implicit_euler")}) {
      EXPECT_NE(error.find(part), std::string::npos) << error;
    }
  }
}

}  // namespace
}  // namespace pellicle::ringing_balloon_test
