#include "prism/metric_energy.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "geometry/principal_axes.h"
#include "tests/prism/elements.h"
#include "tests/support/print_once.h"

namespace pellicle {
namespace {

using Vector9d = Eigen::Matrix<double, 9, 1>;
using Matrix9d = Eigen::Matrix<double, 9, 9>;

MetricEnergy energy_of(const Material& material, ThicknessRule rule, const TestElement& element) {
  return metric_energy(material, rule, element.rest(), element.metric(), given_ratio);
}

Matrix9d matrix_of(const MetricEnergy& energy, const TestElement& element) { return element_matrix(energy, element); }

TestElement moved(TestElement element, const Vector9d& w) {
  element.e12 += w.segment<3>(3) - w.head<3>();
  element.e13 += w.segment<3>(6) - w.head<3>();
  return element;
}

/// Calls `work(name, material, rule, element)` for every law and rule, with elements that bear any of them.
template <class Work>
int for_all(const Work& work) {
  int count = 0;
  std::mt19937 random(5);
  const std::vector<Eigen::Vector2d> stretches{{1, 1}, {1.1, 1.1}, {1.25, 0.9}, {1.3, 1.2}, {0.9, 0.8}, {1.2, 1.2001}};
  for (const auto& [material_name, material] : test_materials()) {
    for (const auto& [rule_name, rule] : test_rules) {
      for (const Eigen::Vector2d& stretch : stretches) {
        work(material_name + ", " + rule_name, material, rule, random_element(random, stretch[0], stretch[1]));
        ++count;
      }
    }
  }
  return count;
}

TEST(MetricEnergy, RemaindersOfTaylorSeriesAreOfThirdAndSecondOrder) {
  std::mt19937 random(6);
  std::normal_distribution<double> normal;
  double lowest_energy_order = 9, lowest_force_order = 9;
  const int count =
      for_all([&](const std::string& name, const Material& material, ThicknessRule rule, const TestElement& element) {
        const MetricEnergy at = energy_of(material, rule, element);
        const Vector9d gradient = gradient_of_vertices(at.gradient, element);
        const Matrix9d k = matrix_of(at, element);
        const Vector9d w = Vector9d::NullaryExpr([&] { return 0.01 * normal(random); });
        std::array<double, 2> energy_remainder, force_remainder;
        for (std::size_t i = 0; i < 2; ++i) {
          const double step = i == 0 ? 4e-4 : 2e-4;
          const TestElement there = moved(element, step * w);
          const MetricEnergy energy = energy_of(material, rule, there);
          energy_remainder[i] =
              std::abs(energy.energy - at.energy - step * gradient.dot(w) - step * step / 2 * w.dot(k * w));
          force_remainder[i] = (gradient_of_vertices(energy.gradient, there) - gradient - step * k * w).norm();
        }
        const double energy_order = std::log2(energy_remainder[0] / energy_remainder[1]);
        const double force_order = std::log2(force_remainder[0] / force_remainder[1]);
        EXPECT_GT(energy_order, 2.9) << name;
        EXPECT_GT(force_order, 1.95) << name;
        lowest_energy_order = std::min(lowest_energy_order, energy_order);
        lowest_force_order = std::min(lowest_force_order, force_order);
      });
  print_once("%d elements: order of the remainder of energy at least %.3f, of force %.3f\n", count, lowest_energy_order,
             lowest_force_order);
}

TEST(MetricEnergy, ForcesAndMatrixAreCentralDifferences) {
  double worst_force = 0, worst_matrix = 0;
  const int count = for_all([&](const std::string& name, const Material& material, ThicknessRule rule,
                                const TestElement& element) {
    const MetricEnergy at = energy_of(material, rule, element);
    const Vector9d gradient = gradient_of_vertices(at.gradient, element);
    const Matrix9d k = matrix_of(at, element);
    Vector9d force_error;
    Matrix9d matrix_error;
    for (int i = 0; i < 9; ++i) {
      const double h = 1e-7;  // of elements of size 0.01
      const TestElement plus = moved(element, h * Vector9d::Unit(i)), minus = moved(element, -h * Vector9d::Unit(i));
      const MetricEnergy up = energy_of(material, rule, plus), down = energy_of(material, rule, minus);
      force_error[i] = (up.energy - down.energy) / (2 * h) - gradient[i];
      matrix_error.col(i) =
          (gradient_of_vertices(up.gradient, plus) - gradient_of_vertices(down.gradient, minus)) / (2 * h) - k.col(i);
    }
    const double stiffness = k.cwiseAbs().maxCoeff();
    worst_force = std::max(worst_force, force_error.cwiseAbs().maxCoeff() / (stiffness * 0.01));
    worst_matrix = std::max(worst_matrix, matrix_error.cwiseAbs().maxCoeff() / stiffness);
    EXPECT_LT(force_error.cwiseAbs().maxCoeff(), 1e-8 * stiffness * 0.01) << name;
    EXPECT_LT(matrix_error.cwiseAbs().maxCoeff(), 1e-8 * stiffness) << name;
    EXPECT_LT((k - k.transpose()).cwiseAbs().maxCoeff(), 1e-14 * stiffness) << name;
    EXPECT_LT((k.leftCols<3>() + k.middleCols<3>(3) + k.rightCols<3>()).cwiseAbs().maxCoeff(), 1e-14 * stiffness);
  });
  print_once("%d elements: worst relative difference of force %.1e, of matrix %.1e\n", count, worst_force,
             worst_matrix);
}

TEST(MetricEnergy, NothingAtRestAndTheSameWhenTurned) {
  std::mt19937 random(7);
  for (const auto& [material_name, material] : test_materials()) {
    for (const auto& [rule_name, rule] : test_rules) {
      TestElement element = random_element(random, 1, 1);
      const RestMetric rest = element.rest();
      const MetricEnergy energy = metric_energy(material, rule, rest, element.metric(), 1);
      const double unit = 1e6 * rest.volume;
      EXPECT_NEAR(energy.energy, 0, 1e-14 * unit) << material_name << ", " << rule_name;
      EXPECT_LT(gradient_of_vertices(energy.gradient, element).norm(), 1e-13 * unit / 0.01);
      EXPECT_NEAR(energy.thickness_ratio, 1, 1e-14);

      element = random_element(random, 1.2, 0.9);
      const MetricEnergy before = energy_of(material, rule, element);
      const Matrix9d k = matrix_of(before, element);
      const Eigen::Matrix3d turn = random_rotation(random);
      element.e12 = turn * element.e12;
      element.e13 = turn * element.e13;
      const MetricEnergy after = energy_of(material, rule, element);
      EXPECT_NEAR(after.energy, before.energy, 1e-13 * unit);
      const Matrix9d turned = matrix_of(after, element);
      for (int i = 0; i < 9; i += 3) {
        for (int j = 0; j < 9; j += 3) {
          EXPECT_LT((turned.block<3, 3>(i, j) - turn * k.block<3, 3>(i, j) * turn.transpose()).norm(),
                    1e-12 * k.norm());
        }
      }
      // An infinitesimal rotation changes forces by turning them.
      const Eigen::Vector3d axis(0.3, -0.7, 0.2);
      const Vector9d force = gradient_of_vertices(after.gradient, element);
      Vector9d w, turned_force;
      w << Eigen::Vector3d::Zero(), axis.cross(element.e12), axis.cross(element.e13);
      for (int i = 0; i < 9; i += 3) {
        turned_force.segment<3>(i) = axis.cross(force.segment<3>(i));
      }
      EXPECT_LT((turned * w - turned_force).norm(), 1e-12 * k.norm() * 0.01);
    }
  }
}

/// Cauchy stress of an element stretched equally in both directions: a : dU/da = V S l^2.
double equibiaxial_stress(const Material& material, ThicknessRule rule, double stretch) {
  std::mt19937 random(8);
  const TestElement element = random_element(random, stretch, stretch);
  const MetricEnergy energy = metric_energy(material, rule, element.rest(), element.metric(), 1);
  return energy.gradient.dot(element.metric()) / element.rest().volume;
}

TEST(MetricEnergy, EquibiaxialAndUniaxialStressesHaveTheirClosedForms) {
  int count = 0;
  const std::vector<NamedMaterial> materials = test_materials();
  const Material &neo_hookean = materials[1].material, &mooney = materials[2].material, &ogden = materials[3].material;
  for (const double l : {0.8, 1.0, 1.1, 1.38309, 2.0, 3.0, 5.0}) {
    const auto expect = [&](const Material& material, double equibiaxial, double uniaxial) {
      EXPECT_NEAR(equibiaxial_stress(material, ThicknessRule::incompressible, l), equibiaxial, 1e-11 * 1e6 * l * l * l);
      std::mt19937 random(9);
      const TestElement element = random_element(random, l, 1 / std::sqrt(l));
      const RestMetric rest = element.rest();
      const MetricEnergy energy = metric_energy(material, ThicknessRule::incompressible, rest, element.metric(), 1);
      const Eigen::Vector2d s = principal_axes(in_plane_stress(energy.gradient, rest)).values;
      EXPECT_NEAR((l > 1 ? s[1] : s[0]) * l * l, uniaxial, 1e-11 * 1e6 * l * l * l);
      EXPECT_NEAR((l > 1 ? s[0] : s[1]) / l, 0, 1e-11 * 1e6 * l * l * l);
      EXPECT_NEAR(energy.thickness_ratio, 1 / std::sqrt(l), 1e-13);
      count += 3;
    };
    expect(neo_hookean, neo_hookean.mu * (l * l - std::pow(l, -4)), neo_hookean.mu * (l * l - 1 / l));
    expect(mooney, 2 * (mooney.c1 + mooney.c2 * l * l) * (l * l - std::pow(l, -4)),
           2 * (mooney.c1 + mooney.c2 / l) * (l * l - 1 / l));
    double equibiaxial = 0, uniaxial = 0;
    for (std::size_t k = 0; k < ogden.ogden_mu.size(); ++k) {
      const double mu = ogden.ogden_mu[k], alpha = ogden.ogden_alpha[k];
      equibiaxial += mu * (std::pow(l, alpha) - std::pow(l, -2 * alpha));
      uniaxial += mu * (std::pow(l, alpha) - std::pow(l, -alpha / 2));
    }
    expect(ogden, equibiaxial, uniaxial);
  }
  print_once("%d stresses of incompressible materials\n", count);
}

// p R/h = 2 sigma / l^3; validation of the values where the pressure of a sphere is highest.
TEST(MetricEnergy, PressureOfASphereAtItsLimitPoints) {
  const std::vector<NamedMaterial> materials = test_materials();
  const auto pressure = [](const Material& material, double l) {
    return 2 * equibiaxial_stress(material, ThicknessRule::incompressible, l) / (l * l * l);
  };
  const double limit = std::pow(7, 1.0 / 6);
  EXPECT_NEAR(pressure(materials[1].material, limit) / materials[1].material.mu, 1.23946, 1e-5);
  Material mooney = materials[2].material;
  mooney.c2 = 0.1 * mooney.c1;
  EXPECT_NEAR(pressure(mooney, 1.4761) / mooney.c1, 2.98124, 1e-5);
  EXPECT_NEAR(pressure(mooney, 3.1427) / mooney.c1, 2.52724, 1e-5);
  EXPECT_NEAR(pressure(materials[3].material, 1.3741), 5.4941e5, 10);
  EXPECT_NEAR(pressure(materials[3].material, 4.3203), 2.3555e5, 10);
}

TEST(MetricEnergy, StVenantKirchhoffInPlaneStressIsLinearInStrain) {
  const Material material = test_materials()[0].material;
  const double young = material.mu * (3 * material.lambda + 2 * material.mu) / (material.lambda + material.mu);
  const double poisson = material.lambda / (2 * (material.lambda + material.mu));
  for (const double l : {0.7, 1.0, 1.1, 1.3}) {
    EXPECT_NEAR(equibiaxial_stress(material, ThicknessRule::plane_stress, l),
                l * l * young / (1 - poisson) * (l * l - 1) / 2, 1e-12 * young);
  }
}

TEST(MetricEnergy, PlaneStressLeavesNoneAcrossTheWallAndNeedsNoGoodStart) {
  std::mt19937 random(10);
  for (const auto& [name, material] : test_materials()) {
    for (const Eigen::Vector2d& stretch : {Eigen::Vector2d(1.2, 1.3), Eigen::Vector2d(0.8, 1.1)}) {
      const TestElement element = random_element(random, stretch[0], stretch[1]);
      const MetricEnergy energy = energy_of(material, ThicknessRule::plane_stress, element);
      const double t = stretch.squaredNorm(), d = std::pow(stretch.prod(), 2), c = std::pow(energy.thickness_ratio, 2);
      EXPECT_NEAR(energy_density(material, t, d, c).gradient[2], 0, 1e-9 * 1e6) << name;
      for (const double start : {0.05, 0.5, 3.0, 0.0}) {
        EXPECT_NEAR(metric_energy(material, ThicknessRule::plane_stress, element.rest(), element.metric(), start)
                        .thickness_ratio,
                    energy.thickness_ratio, 1e-13)
            << name << " from " << start;
      }
    }
  }
}

TEST(MetricEnergy, PlaneStressTendsToIncompressible) {
  std::mt19937 random(11);
  const TestElement element = random_element(random, 1.4, 1.1);
  for (const std::size_t law : {1, 2, 3}) {  // St. Venant-Kirchhoff has no such limit
    std::array<double, 2> difference;
    for (std::size_t i = 0; i < 2; ++i) {
      const Material material = test_materials(i == 0 ? 1e9 : 1e10)[law].material;
      const MetricEnergy limit = energy_of(material, ThicknessRule::incompressible, element);
      const MetricEnergy energy = energy_of(material, ThicknessRule::plane_stress, element);
      difference[i] = (energy.gradient - limit.gradient).norm() / limit.gradient.norm();
      EXPECT_LT((energy.hessian - limit.hessian).norm(), 10 * difference[i] * limit.hessian.norm());
    }
    EXPECT_NEAR(difference[0] / difference[1], 10, 0.1) << law;
    EXPECT_LT(difference[1], 1e-4) << law;
  }
}

TEST(MetricEnergy, CollapseIsInfinite) {
  TestElement element;
  element.rest12 = {0.01, 0, 0};
  element.rest13 = {0, 0.01, 0};
  element.e12 = {0.01, 0, 0};
  element.e13 = {0.02, 0, 0};
  for (const auto& [material_name, material] : test_materials()) {
    for (const auto& [rule_name, rule] : test_rules) {
      const MetricEnergy energy = energy_of(material, rule, element);
      EXPECT_EQ(energy.energy, std::numeric_limits<double>::infinity()) << material_name << ", " << rule_name;
      EXPECT_FALSE(energy.gradient.allFinite());
    }
  }
  // c = 1 - lambda (t - 2)/(lambda + 2 mu) would be negative.
  element.e12 = {0.03, 0, 0};
  element.e13 = {0, 0.03, 0};
  EXPECT_EQ(energy_of(test_materials()[0].material, ThicknessRule::plane_stress, element).energy,
            std::numeric_limits<double>::infinity());
}

/// The smallest and the largest eigenvalue.
Eigen::Vector2d range_of_eigenvalues(const Matrix9d& k) {
  const Eigen::VectorXd values = principal_axes(k).values;
  return {values[0], values[8]};
}

TEST(PositivePart, OfAnyElementIsSymmetricAndHasNoNegativeEigenvalue) {
  std::mt19937 random(12);
  int count = 0, indefinite = 0, by_gradient = 0, by_hessian = 0;
  for (const auto& [material_name, material] : test_materials()) {
    for (const auto& [rule_name, rule] : test_rules) {
      for (const Eigen::Vector2d& stretch :
           {Eigen::Vector2d(0.7, 0.8), Eigen::Vector2d(1.3, 0.6), Eigen::Vector2d(1.1, 0.95), Eigen::Vector2d(1, 1),
            Eigen::Vector2d(1.2, 1.1), Eigen::Vector2d(4, 4), Eigen::Vector2d(0.9, 0.9)}) {
        const TestElement element = random_element(random, stretch[0], stretch[1]);
        const RestMetric rest = element.rest();
        const MetricEnergy exact = energy_of(material, rule, element);
        if (!std::isfinite(exact.energy)) {
          continue;  // St. Venant-Kirchhoff at 4 in plane stress
        }
        const MetricEnergy positive = positive_part(exact, rest);
        const Matrix9d k = element_matrix(positive, element);
        const Eigen::Vector2d range = range_of_eigenvalues(k);
        EXPECT_GE(range[0], -1e-13 * range[1]) << material_name << ", " << rule_name << " at " << stretch.transpose();
        EXPECT_LT((k - k.transpose()).norm(), 1e-14 * k.norm());

        // The nearest positive one, in orthonormal axes: X+ (X+ - X) = 0 with both factors positive.
        const Eigen::Matrix2d s = in_plane_stress(exact.gradient, rest), sp = in_plane_stress(positive.gradient, rest);
        EXPECT_LT((sp * (sp - s)).norm(), 1e-12 * s.squaredNorm() + 1e-9);
        EXPECT_GE(principal_axes(sp - s).values[0], -1e-12 * s.norm());
        const Eigen::Matrix3d inverse = cauchy_green_of_metric(rest).inverse();
        const Eigen::Matrix3d h = inverse.transpose() * exact.hessian * inverse;
        const Eigen::Matrix3d hp = inverse.transpose() * positive.hessian * inverse;
        EXPECT_LT((hp * (hp - h)).norm(), 1e-12 * h.squaredNorm());
        EXPECT_GE(principal_axes(hp).values[0], -1e-12 * h.norm());

        if (principal_axes(s).values[0] >= 0) {
          EXPECT_EQ(positive.gradient, exact.gradient);
        }
        const bool is_convex =
            material.law == Choice<Material::Law>("st_venant_kirchhoff") ||
            (material.law == Choice<Material::Law>("neo_hookean") && rule == ThicknessRule::incompressible);
        if (is_convex) {
          EXPECT_EQ(positive.hessian, exact.hessian) << material_name << ", " << rule_name;
        }
        ++count;
        by_gradient += positive.gradient != exact.gradient ? 1 : 0;
        by_hessian += positive.hessian != exact.hessian ? 1 : 0;
        const Eigen::Vector2d exact_range = range_of_eigenvalues(matrix_of(exact, element));
        indefinite += exact_range[0] < -1e-6 * exact_range[1] ? 1 : 0;
      }
    }
  }
  print_once("%d elements, %d of them indefinite; %d gradients and %d Hessians changed\n", count, indefinite,
             by_gradient, by_hessian);
  EXPECT_GT(indefinite, 20);
  EXPECT_GT(by_gradient, 20);
  EXPECT_GT(by_hessian, 0);
}

}  // namespace
}  // namespace pellicle
