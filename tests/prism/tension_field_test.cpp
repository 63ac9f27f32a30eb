// The relaxed energy of a wall that bears no compression: derivatives, uniaxial tension, what is slack.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "geometry/principal_axes.h"
#include "prism/metric_energy.h"
#include "tests/prism/elements.h"

namespace pellicle::tension_field_test {
namespace {

const std::vector<ThicknessRule> rules{ThicknessRule::incompressible, ThicknessRule::plane_stress};

std::vector<NamedMaterial> wrinkling_materials() {
  std::vector<NamedMaterial> all = test_materials();
  for (NamedMaterial& named : all) {
    named.material.wrinkles = true;
  }
  return all;
}

MetricEnergy energy_of(const Material& material, ThicknessRule rule, const TestElement& element) {
  return metric_energy(material, rule, element.rest(), element.metric(), 1);
}

/// By the metric, in all directions: remainders of third and second order.
void expect_derivatives(const std::string& name, const Material& material, ThicknessRule rule,
                        const TestElement& element) {
  const RestMetric rest = element.rest();
  const Eigen::Vector3d a = element.metric();
  const MetricEnergy at = metric_energy(material, rule, rest, a, 1);
  for (const Eigen::Vector3d& displacement : {Eigen::Vector3d(1, 0.3, -0.4), Eigen::Vector3d(-0.2, 1, 0.5)}) {
    std::array<double, 2> of_energy{}, of_gradient{};
    for (std::size_t i = 0; i < 2; ++i) {
      const Eigen::Vector3d step = (i == 0 ? 4e-4 : 2e-4) * a.norm() * displacement;
      const MetricEnergy there = metric_energy(material, rule, rest, a + step, 1);
      of_energy[i] = std::abs(there.energy - at.energy - at.gradient.dot(step) - step.dot(at.hessian * step) / 2);
      of_gradient[i] = (there.gradient - at.gradient - at.hessian * step).norm();
    }
    EXPECT_NEAR(std::log2(of_energy[0] / of_energy[1]), 3, 0.1) << name;
    EXPECT_NEAR(std::log2(of_gradient[0] / of_gradient[1]), 2, 0.1) << name;
  }
}

TEST(TensionField, HasItsDerivativesAndIsConvexWhereItWrinkles) {
  std::mt19937 random(8);
  for (const auto& [name, material] : wrinkling_materials()) {
    for (const ThicknessRule rule : rules) {
      for (const Eigen::Vector2d& stretch : {Eigen::Vector2d(1.4, 0.6), {1.15, 0.8}, {1.6, 0.3}, {1.01, 0.9}}) {
        const TestElement element = random_element(random, stretch[0], stretch[1]);
        expect_derivatives(name, material, rule, element);
        const MetricEnergy energy = energy_of(material, rule, element);
        const Eigen::VectorXd eigenvalues = principal_axes(element_matrix(energy, element)).values;
        EXPECT_GE(eigenvalues.minCoeff(), -1e-9 * eigenvalues.maxCoeff()) << name;
      }
    }
  }
}

TEST(TensionField, IsWhatItWasWhereItIsTaut) {
  std::mt19937 random(9);
  for (const auto& [name, material] : wrinkling_materials()) {
    for (const ThicknessRule rule : rules) {
      for (const Eigen::Vector2d& stretch : {Eigen::Vector2d(1.3, 1.2), {1.2, 0.98}, {1.1, 1.1}}) {
        const TestElement element = random_element(random, stretch[0], stretch[1]);
        Material plain = material;
        plain.wrinkles = false;
        const MetricEnergy relaxed = energy_of(material, rule, element);
        const MetricEnergy full = energy_of(plain, rule, element);
        EXPECT_EQ(relaxed.energy, full.energy) << name;
        EXPECT_EQ(relaxed.gradient, full.gradient) << name;
        EXPECT_EQ(relaxed.hessian, full.hessian) << name;
      }
    }
  }
}

TEST(TensionField, IsUniaxialTensionWhateverTheWidth) {
  std::mt19937 random(10);
  for (const auto& [name, material] : wrinkling_materials()) {
    for (const ThicknessRule rule : rules) {
      // The least energy over the widths, of the full energy.
      Material plain = material;
      plain.wrinkles = false;
      double least = HUGE_VAL;
      double width = 0;
      double thickness_ratio = 0;
      TestElement square;
      square.rest12 = {0.01, 0, 0};
      square.rest13 = {0, 0.01, 0};
      for (double w = 0.7; w < 1; w += 1e-5) {
        square.e12 = {0.014, 0, 0};
        square.e13 = {0, 0.01 * w, 0};
        const MetricEnergy full = energy_of(plain, rule, square);
        if (full.energy < least) {
          least = full.energy;
          width = w;
          thickness_ratio = full.thickness_ratio;
        }
      }
      for (const double w : {0.2, 0.6, 0.99 * width}) {
        square.e13 = {0, 0.01 * w, 0};
        const MetricEnergy relaxed = energy_of(material, rule, square);
        EXPECT_NEAR(relaxed.energy, least, 1e-8 * least) << name;
        EXPECT_NEAR(relaxed.thickness_ratio, thickness_ratio, 1e-5) << name;
        const PrincipalState state =
            principal_state(material, rule, square.rest(), square.e12, square.e13, relaxed.thickness_ratio);
        EXPECT_NEAR(state.stress[1], 0, 1e-9 * state.stress[0]) << name;
        EXPECT_GT(state.stress[0], 0) << name;
      }
      const double mu = 4e5;
      if (name == "neo-Hookean" && rule == ThicknessRule::incompressible) {
        const double volume = square.rest().volume;
        EXPECT_NEAR(least, volume * mu / 2 * (1.4 * 1.4 + 2 / 1.4 - 3), 1e-8 * least);
        EXPECT_NEAR(width, 1 / std::sqrt(1.4), 1e-5);
      }
    }
  }
}

TEST(TensionField, HasNoForceWhereItIsSlack) {
  std::mt19937 random(11);
  for (const auto& [name, material] : wrinkling_materials()) {
    for (const ThicknessRule rule : rules) {
      for (const Eigen::Vector2d& stretch : {Eigen::Vector2d(0.99, 0.97), {0.9, 0.4}, {0.3, 0.3}}) {
        const MetricEnergy energy = energy_of(material, rule, random_element(random, stretch[0], stretch[1]));
        EXPECT_EQ(energy.energy, 0) << name;
        EXPECT_EQ(energy.gradient.norm(), 0) << name;
        EXPECT_EQ(energy.hessian.norm(), 0) << name;
      }
    }
  }
}

TEST(TensionField, HasATensionInAllDirectionsIfAskedFor) {
  constexpr double tension = 50;  // [Pa]
  std::mt19937 random(12);
  for (auto [name, material] : wrinkling_materials()) {
    material.tension = tension;
    for (const ThicknessRule rule : rules) {
      const TestElement slack = random_element(random, 0.9, 0.4);
      const PrincipalState state = principal_state(material, rule, slack.rest(), slack.e12, slack.e13, 1);
      EXPECT_NEAR(state.stress[0], tension * 0.9 / 0.4, 1e-9 * tension) << name;
      EXPECT_NEAR(state.stress[1], tension * 0.4 / 0.9, 1e-9 * tension) << name;
      const MetricEnergy energy = energy_of(material, rule, slack);
      const Eigen::VectorXd eigenvalues = principal_axes(element_matrix(energy, slack)).values;
      EXPECT_NEAR(eigenvalues[2], 0, 1e-9 * eigenvalues[8]) << name << ": it may be shifted";
      EXPECT_GT(eigenvalues[3], 1e-3 * eigenvalues[8]) << name;
      expect_derivatives(name, material, rule, random_element(random, 1.4, 0.6));
    }
  }
}

}  // namespace
}  // namespace pellicle::tension_field_test
