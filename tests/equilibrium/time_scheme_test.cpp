// The time schemes on a single vertex: damped and undamped oscillators, whose motion is a formula.

#include "equilibrium/time_scheme.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <complex>

namespace pellicle {
namespace {

/// A mass of 1 kg on a spring with damping, pulled by a constant force [1/s^2, 1/s, N].
struct Oscillator {
  double stiffness = 0;
  double damping = 0;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
};

struct Point {
  Eigen::Vector3d position;
  Kinematics motion;
};

/// Solves for y, in which the step's equation is linear.
Point step(const TimeIntegrator& integrator, const Oscillator& oscillator, double h, const Point& start) {
  const double k = integrator.inertia(h);
  const double c = integrator.rate(h);
  const Eigen::Vector3d y =
      (k * (start.position + integrator.y_a(h, start.motion)) +
       oscillator.damping * c * (start.position + integrator.y_v(h, start.motion)) + oscillator.force) /
      (k + oscillator.damping * c + oscillator.stiffness);
  const Eigen::Vector3d displacement = (y - start.position) / integrator.fraction();
  return {start.position + displacement, integrator.end(h, displacement, start.motion)};
}

TEST(TimeScheme, WhatIsInBalanceIsBetweenTheEndsOfTheStep) {
  constexpr double h = 0.3;
  const Kinematics start{{1, -2, 0.5}, {3, 0.25, -4}};
  const Eigen::Vector3d displacement(0.4, 0.1, -0.7);
  for (const double radius : {0.0, 0.3, 0.8, 1.0}) {
    const TimeIntegrator integrator = TimeIntegrator::generalized_alpha(radius);
    const double alpha_m = (2 * radius - 1) / (radius + 1);
    const double alpha_f = radius / (radius + 1);
    const double gamma = 0.5 - alpha_m + alpha_f;
    const double beta = std::pow(1 - alpha_m + alpha_f, 2) / 4;
    const Kinematics end = integrator.end(h, displacement, start);
    // Newmark's formulas
    const Eigen::Vector3d displacement =
        h * start.velocity + h * h * ((0.5 - beta) * start.acceleration + beta * end.acceleration);
    EXPECT_LE((displacement - displacement).norm(), 1e-14);
    const Eigen::Vector3d velocity = start.velocity + h * ((1 - gamma) * start.acceleration + gamma * end.acceleration);
    EXPECT_LE((velocity - end.velocity).norm(), 1e-14);
    const Eigen::Vector3d y = integrator.fraction() * displacement;
    EXPECT_NEAR(integrator.fraction(), 1 - alpha_f, 1e-15);
    EXPECT_LE((integrator.rate(h) * (y - integrator.y_v(h, start)) -
               ((1 - alpha_f) * end.velocity + alpha_f * start.velocity))
                  .norm(),
              1e-13);
    EXPECT_LE((integrator.inertia(h) * (y - integrator.y_a(h, start)) -
               ((1 - alpha_m) * end.acceleration + alpha_m * start.acceleration))
                  .norm(),
              1e-13);
  }
  const TimeIntegrator euler;
  EXPECT_EQ(euler.fraction(), 1);
  EXPECT_FALSE(euler.is_second_order());
  EXPECT_EQ(euler.inertia(h), 1 / (h * h));
  EXPECT_EQ(euler.rate(h), 1 / h);
  const Kinematics without{start.velocity, Eigen::Vector3d::Zero()};
  EXPECT_EQ(euler.y_a(h, without), h * start.velocity);
  EXPECT_EQ(euler.y_v(h, without), Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(euler.end(h, displacement, without).velocity, displacement / h);
}

TEST(TimeScheme, TheSpectralRadiusIsThatOfMotionsMuchFasterThanTheStep) {
  for (const double radius : {0.0, 0.3, 0.8, 1.0}) {
    const TimeIntegrator integrator = TimeIntegrator::generalized_alpha(radius);
    for (const double frequency : {1e-2, 1.0, 10.0, 1e5}) {  // omega h
      Oscillator oscillator;
      oscillator.stiffness = frequency * frequency;
      Eigen::Matrix3d amplification;
      for (int k = 0; k < 3; ++k) {
        Eigen::Vector3d unit = Eigen::Vector3d::Unit(k);
        const auto along = [](double value) { return Eigen::Vector3d(value, 0, 0); };
        const Point end = step(integrator, oscillator, 1, {along(unit[0]), {along(unit[1]), along(unit[2])}});
        amplification.col(k) = Eigen::Vector3d(end.position.x(), end.motion.velocity.x(), end.motion.acceleration.x());
      }
      const double largest = Eigen::EigenSolver<Eigen::Matrix3d>(amplification).eigenvalues().cwiseAbs().maxCoeff();
      EXPECT_LE(largest, 1 + 1e-4) << radius << " at " << frequency << ": stable whatever the step";
      if (frequency > 1000) {
        EXPECT_NEAR(largest, radius, 5e-3) << "three eigenvalues become one";
      }
    }
  }
}

/// Position of x'' + 2 d x' + w^2 x = 0 from 1 at rest.
double formula(double frequency, double damping, double time) {
  const double damped = std::sqrt(frequency * frequency - damping * damping / 4);
  return std::exp(-damping / 2 * time) * (std::cos(damped * time) + damping / (2 * damped) * std::sin(damped * time));
}

double error_at_the_end(const TimeIntegrator& integrator, int steps) {
  constexpr double frequency = 2 * M_PI;
  constexpr double damping = 0.5;
  constexpr double end = 1.2;
  const Oscillator oscillator{frequency * frequency, damping, Eigen::Vector3d::Zero()};
  Point point{{1, 0, 0}, {}};
  if (integrator.is_second_order()) {
    point.motion.acceleration = -oscillator.stiffness * point.position;
  }
  for (int k = 0; k < steps; ++k) {
    point = step(integrator, oscillator, end / steps, point);
  }
  return std::abs(point.position.x() - formula(frequency, damping, end));
}

TEST(TimeScheme, GeneralizedAlphaIsOfSecondOrder) {
  for (const double radius : {0.0, 0.5, 0.8, 1.0}) {
    const TimeIntegrator integrator = TimeIntegrator::generalized_alpha(radius);
    const double order = std::log2(error_at_the_end(integrator, 400) / error_at_the_end(integrator, 800));
    EXPECT_NEAR(order, 2, 0.05) << radius;
  }
  EXPECT_NEAR(std::log2(error_at_the_end({}, 4000) / error_at_the_end({}, 8000)), 1, 0.05);
}

TEST(TimeScheme, TheMidpointRuleKeepsEnergy) {
  const Oscillator oscillator{40, 0, Eigen::Vector3d::Zero()};
  for (const double radius : {1.0, 0.8}) {
    Point point{{0, 2, 1}, {{1, 0, 0.5}, -40 * Eigen::Vector3d(0, 2, 1)}};
    const auto energy = [&] {
      return point.motion.velocity.squaredNorm() / 2 + oscillator.stiffness * point.position.squaredNorm() / 2;
    };
    const double before = energy();
    for (int k = 0; k < 1000; ++k) {
      point = step(TimeIntegrator::generalized_alpha(radius), oscillator, 0.1, point);
    }
    if (radius == 1) {
      EXPECT_NEAR(energy(), before, 1e-11 * before);
    } else {
      EXPECT_LT(energy(), 0.9 * before);
    }
  }
}

TEST(TimeScheme, AConstantForceMovesExactlyAndHasNoError) {
  const Oscillator falling{0, 0, {1, 2, -9.81}};
  const TimeIntegrator integrator = TimeIntegrator::generalized_alpha(0.8);
  const Kinematics start{{3, 0, 1}, falling.force};
  const Point end = step(integrator, falling, 0.7, {Eigen::Vector3d::Zero(), start});
  EXPECT_LE((end.position - 0.7 * start.velocity - 0.7 * 0.7 / 2 * falling.force).norm(), 1e-14);
  EXPECT_LE((end.motion.velocity - start.velocity - 0.7 * falling.force).norm(), 1e-14);
  EXPECT_LE(integrator.error(0.7, start, end.motion), 1e-14);
}

// The estimate is of the size of the error of a step from the solution, and falls with the same power of its length.
TEST(TimeScheme, TheEstimatedErrorIsThatOfAStep) {
  const Oscillator oscillator{1, 0, Eigen::Vector3d::Zero()};
  const TimeIntegrator alpha = TimeIntegrator::generalized_alpha(0.8);
  double last = 0;
  for (const double h : {0.1, 0.05, 0.025}) {
    Point point{{1, 0, 0}, {{0, 0, 0}, {-1, 0, 0}}};
    double time = 0;
    double estimate = 0;
    for (; time < 1.5; time += h) {
      const Point next = step(alpha, oscillator, h, point);
      estimate = alpha.error(h, point.motion, next.motion);
      point = next;
    }
    // of a step from the exact motion at a time at which x''' = sin t = 1, nearly
    const double exact = std::abs(std::sin(time)) * h * h * h;
    EXPECT_GT(estimate, 0.08 * exact);
    EXPECT_LT(estimate, 0.25 * exact);
    if (last > 0) {
      EXPECT_NEAR(last / estimate, 8, 0.4);
    }
    last = estimate;
  }
}

}  // namespace
}  // namespace pellicle
