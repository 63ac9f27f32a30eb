#include "prism/material.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "tests/prism/elements.h"
#include "tests/support/print_once.h"

namespace pellicle {
namespace {

/// Squares of principal stretches for which every law is defined; pairs that coincide and nearly do among them.
const std::vector<Eigen::Vector3d> squares{{1, 1, 1},      {1.3, 0.8, 0.9},  {4, 4, 0.06},    {4, 4.0001, 0.07},
                                           {2, 3, 0.2},    {1.21, 1.2, 0.7}, {9, 0.5, 0.22},  {0.7, 0.9, 1.6},
                                           {1, 1.49, 0.8}, {1, 1.5, 0.8},    {1, 1.501, 0.8}, {25, 16, 0.0025}};

/// Central difference of fourth order.
template <class Function>
double difference(const Function& f, double x) {
  const double h = 1e-3 * x;
  return (8 * (f(x + h) - f(x - h)) - (f(x + 2 * h) - f(x - 2 * h))) / (12 * h);
}

TEST(Material, DerivativesAreThoseOfTheValue) {
  int count = 0;
  double worst = 0;
  for (const auto& [name, material] : test_materials()) {
    for (const Eigen::Vector3d& s : squares) {
      const Eigen::Vector3d at(s[0] + s[1], s[0] * s[1], s[2]);
      const EnergyDensity psi = energy_density(material, at[0], at[1], at[2]);
      for (int i = 0; i < 3; ++i) {
        const auto moved = [&, &m = material](double x) {
          Eigen::Vector3d y = at;
          y[i] = x;
          return energy_density(m, y[0], y[1], y[2]);
        };
        const auto expect = [&, &n = name](double is, double expected, double scale) {
          EXPECT_NEAR(is, expected, 1e-8 * scale) << n << " at " << s.transpose() << ", by number " << i;
          worst = std::max(worst, std::abs(is - expected) / scale);
          ++count;
        };
        // Terms of the size of a modulus cancel each other.
        const double scale = std::abs(psi.value) + 1e6;
        expect(psi.gradient[i], difference([&](double x) { return moved(x).value; }, at[i]), scale / at[i]);
        for (int j = 0; j < 3; ++j) {
          expect(psi.hessian[j][i], difference([&](double x) { return moved(x).gradient[j]; }, at[i]),
                 scale / (at[i] * at[j]));
          EXPECT_EQ(psi.hessian[i][j], psi.hessian[j][i]);
        }
      }
    }
  }
  print_once("materials: %d derivatives, worst relative difference %.1e\n", count, worst);
}

/// l1^alpha + l2^alpha as a function of t and d: value, derivatives t, d, tt, td, dd.
std::array<double, 6> closed_power_sum(int alpha, double t, double d) {
  switch (alpha) {
    case 1: {
      const double g = std::sqrt(t + 2 * std::sqrt(d)), u_d = 1 / std::sqrt(d), g3 = g * g * g;
      return {g, 1 / (2 * g), u_d / (2 * g), -1 / (4 * g3), -u_d / (4 * g3), -u_d / (4 * d * g) - u_d * u_d / (4 * g3)};
    }
    case 6:
      return {t * t * t - 3 * t * d, 3 * t * t - 3 * d, -3 * t, 6 * t, -3, 0};
    case 8:
      return {t * t * t * t - 4 * t * t * d + 2 * d * d,
              4 * t * t * t - 8 * t * d,
              -4 * t * t + 4 * d,
              12 * t * t - 8 * d,
              -8 * t,
              4};
    case -2:
      return {t / d, 1 / d, -t / (d * d), 0, -1 / (d * d), 2 * t / (d * d * d)};
    default:  // -4
      return {(t * t - 2 * d) / (d * d),
              2 * t / (d * d),
              -2 * t * t / (d * d * d) + 2 / (d * d),
              2 / (d * d),
              -4 * t / (d * d * d),
              6 * t * t / (d * d * d * d) - 4 / (d * d * d)};
  }
}

// Where both stretches are equal the power sums' derivatives are 0/0. Exponents whose sums have a closed form in (t, d)
// show the digits that are left, on both sides of where the way of computing changes ((s1 - s2)/(s1 + s2) = 0.2).
TEST(Material, OgdenKeepsItsDigitsWhereStretchesCoincide) {
  int count = 0;
  double worst = 0;
  for (const int alpha : {1, 6, 8, -2, -4}) {
    Material material;
    material.law = Choice<Material::Law>("ogden");
    material.ogden_mu = {static_cast<double>(alpha)};
    material.ogden_alpha = {static_cast<double>(alpha)};
    for (const double mean : {0.3, 1.0, 1.7, 9.0}) {
      for (const double z : {0.0, 1e-12, 1e-8, 1e-5, 1e-3, 0.03, 0.1, 0.19, 0.199999, 0.200001, 0.21, 0.3, 0.6, 0.9}) {
        const double t = 2 * mean, d = mean * mean * (1 - z) * (1 + z);
        const double j = -alpha / 2.0;  // of the term in ln J^2, which is no part of the sum
        const std::array<double, 6> expected = closed_power_sum(alpha, t, d);
        const EnergyDensity psi = energy_density(material, t, d, 1);
        const std::array<double, 6> is{psi.value - j * std::log(d) + 2,
                                       psi.gradient[0],
                                       psi.gradient[1] - j / d,
                                       psi.hessian[0][0],
                                       psi.hessian[0][1],
                                       psi.hessian[1][1] + j / (d * d)};
        const std::array<double, 6> unit{1, t, d, t * t, t * d, d * d};
        for (std::size_t i = 0; i < 6; ++i) {
          const double scale = (expected[0] + std::abs(j)) / unit[i];
          EXPECT_NEAR(is[i], expected[i], 1e-12 * scale) << "alpha " << alpha << " z " << z << " derivative " << i;
          worst = std::max(worst, std::abs(is[i] - expected[i]) / scale);
          ++count;
        }
      }
    }
  }
  print_once("Ogden: %d figures beside the equal stretches, worst relative difference %.1e\n", count, worst);
}

TEST(Material, OgdenWithExponentsTwoAndMinusTwoIsMooneyRivlin) {
  Material ogden, mooney;
  mooney.law = Choice<Material::Law>("mooney_rivlin");
  mooney.c1 = 1.8e5;
  mooney.c2 = 0.2e5;
  ogden.law = Choice<Material::Law>("ogden");
  ogden.ogden_mu = {2 * mooney.c1, -2 * mooney.c2};
  ogden.ogden_alpha = {2, -2};
  for (const Eigen::Vector2d& s : {Eigen::Vector2d(1, 1), Eigen::Vector2d(2, 2), Eigen::Vector2d(1.3, 7)}) {
    const double t = s.sum(), d = s.prod();
    EXPECT_NEAR(energy_density(ogden, t, d, 1 / d).value, energy_density(mooney, t, d, 1 / d).value, 1e-8);
  }
}

}  // namespace
}  // namespace pellicle
