#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "geometry/principal_axes.h"
#include "prism/gradient_stiffness.h"
#include "tests/prism/elements.h"
#include "tests/support/print_once.h"

namespace pellicle {
namespace {

using Vector9d = Eigen::Matrix<double, 9, 1>;

const std::vector<Eigen::Vector2d> stretches{{1, 1}, {1.1, 1.1}, {1.25, 0.9}, {1.3, 1.2}, {0.85, 0.8}, {0.85, 1.2}};

GradientElement gradient_of(const Material& material, ThicknessRule rule, const TestElement& element) {
  return gradient_element(material, rule, element.rest(), element.e12, element.e13, given_ratio);
}

/// Change of the forces for displacements w.
Vector9d action(const GradientElement& element, Director director, const Vector9d& w) {
  const Eigen::Vector3d corners[3] = {w.head<3>(), w.segment<3>(3), w.tail<3>()};
  Eigen::Vector3d product[3];
  gradient_action(element, director, corners, product);
  Vector9d result;
  result << -product[0], -product[1], -product[2];
  return result;
}

/// -V P dF/dx with P = F S (balloon paper, eq. 8 and 9).
Vector9d force(const GradientElement& element) {
  const Eigen::Matrix<double, 3, 2> p = (element.gradient * element.stress).leftCols<2>();
  const Eigen::Matrix<double, 3, 2> f = -element.volume * p * element.inverse_edges.transpose();
  Vector9d result;
  result << -f.col(0) - f.col(1), f.col(0), f.col(1);
  return result;
}

TEST(GradientKernel, ForcesAndTangentAreThoseOfTheMetric) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  int count = 0;
  double worst_force = 0, worst_action = 0;
  for (const auto& [material_name, material] : test_materials()) {
    for (const auto& [rule_name, rule] : test_rules) {
      for (const Eigen::Vector2d& stretch : stretches) {
        const TestElement element = random_element(random, stretch[0], stretch[1]);
        const MetricEnergy energy = metric_energy(material, rule, element.rest(), element.metric(), given_ratio);
        const Eigen::Matrix<double, 9, 9> k = element_matrix(energy, element);
        const GradientElement by_gradient = gradient_of(material, rule, element);
        const Vector9d f = force(by_gradient);
        const double unit = k.cwiseAbs().maxCoeff() * 0.01;
        const double force_error = (f + gradient_of_vertices(energy.gradient, element)).norm() / unit;
        const Vector9d w = Vector9d::NullaryExpr([&] { return 0.01 * normal(random); });
        const double action_error = (action(by_gradient, Director::varied, w) + k * w).norm() / unit;
        EXPECT_LT(force_error, 1e-13) << material_name << ", " << rule_name;
        EXPECT_LT(action_error, 1e-13) << material_name << ", " << rule_name;
        worst_force = std::max(worst_force, force_error);
        worst_action = std::max(worst_action, action_error);
        ++count;
      }
    }
  }
  print_once("%d elements: relative difference of force %.1e, of K w %.1e\n", count, worst_force, worst_action);
}

// Eq. 4, 7, 9 and 11 word for word, in the axes of space and with full matrices.
TEST(GradientKernel, StVenantKirchhoffIsThePapers) {
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  const Material material = test_materials()[0].material;
  for (const Eigen::Vector2d& stretch : stretches) {
    const TestElement element = random_element(random, stretch[0], stretch[1]);
    const double height = given_ratio * element.thickness;
    const Eigen::Vector3d rest_director = element.rest12.cross(element.rest13).normalized();
    const Eigen::Vector3d director = element.e12.cross(element.e13).normalized();
    Eigen::Matrix3d undeformed, deformed;
    undeformed << element.rest12, element.rest13, element.thickness * rest_director;
    deformed << element.e12, element.e13, height * director;
    const Eigen::Matrix3d inverse = undeformed.inverse();
    const Eigen::Matrix3d f = deformed * inverse, one = Eigen::Matrix3d::Identity();
    const Eigen::Matrix3d strain = (f.transpose() * f - one) / 2;
    const Eigen::Matrix3d s = 2 * material.mu * strain + material.lambda * strain.trace() * one;

    const Vector9d w = Vector9d::NullaryExpr([&] { return 0.01 * normal(random); });
    Eigen::Matrix3d edges;
    edges << w.segment<3>(3) - w.head<3>(), w.tail<3>() - w.head<3>(), Eigen::Vector3d::Zero();
    const Eigen::Matrix3d df = edges * inverse;
    const Eigen::Matrix3d dstrain = (df.transpose() * f + f.transpose() * df) / 2;
    const Eigen::Matrix3d ds = 2 * material.mu * dstrain + material.lambda * dstrain.trace() * one;
    const double volume = element.rest().volume;
    const Eigen::Matrix3d forces = -volume * (df * s + f * ds) * inverse.transpose();
    Vector9d expected;
    expected << -forces.col(0) - forces.col(1), forces.col(0), forces.col(1);

    const GradientElement by_gradient = gradient_of(material, ThicknessRule::fixed, element);
    EXPECT_LT((action(by_gradient, Director::left_out, w) - expected).norm(), 1e-12 * expected.norm());
    EXPECT_GT((action(by_gradient, Director::varied, w) - expected).norm(), 1e-3 * expected.norm());
    EXPECT_LT((by_gradient.shear - material.mu * Eigen::Matrix2d::Identity()).norm(), 1e-9 * material.mu);

    // P in the axes of space, by the turn between the two sets of undeformed axes.
    Eigen::Matrix3d axes;
    axes << element.rest12.normalized(), rest_director.cross(element.rest12).normalized(), rest_director;
    EXPECT_LT((by_gradient.gradient * axes.transpose() - f).norm(), 1e-13);
    EXPECT_LT((by_gradient.gradient * by_gradient.stress * axes.transpose() - f * s).norm(), 1e-12 * material.mu);
  }
}

TEST(GradientKernel, WithoutWorkWhereTheElementTurns) {
  std::mt19937 random(5);
  for (const auto& [material_name, material] : test_materials()) {
    TestElement element = random_element(random, 1.2, 0.9);
    const Vector9d w = Vector9d::Unit(4) - 0.3 * Vector9d::Unit(8);
    const Eigen::Matrix3d turn = random_rotation(random);
    for (const Director director : {Director::varied, Director::left_out}) {
      const Vector9d before = action(gradient_of(material, ThicknessRule::fixed, element), director, w);
      TestElement turned = element;
      turned.e12 = turn * element.e12;
      turned.e13 = turn * element.e13;
      const Eigen::Matrix<double, 3, 3> corners = turn * Eigen::Map<const Eigen::Matrix3d>(w.data());
      const Vector9d after = action(gradient_of(material, ThicknessRule::fixed, turned), director,
                                    Eigen::Map<const Vector9d>(corners.data()));
      const Eigen::Matrix3d expected = turn * Eigen::Map<const Eigen::Matrix3d>(before.data());
      EXPECT_LT((after - Eigen::Map<const Vector9d>(expected.data())).norm(), 1e-12 * before.norm()) << material_name;
    }
    // At rest nothing resists a rotation, unless the director is left behind.
    element.e12 = element.rest12;
    element.e13 = element.rest13;
    const GradientElement rest =
        gradient_element(material, ThicknessRule::fixed, element.rest(), element.e12, element.e13, 1);
    const Eigen::Vector3d axis = element.e12.normalized();
    Vector9d rotation;
    rotation << Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), axis.cross(element.e13);
    const double scale = action(rest, Director::left_out, rotation).norm();
    EXPECT_GT(scale, 1e-2 * rest.volume * 1e5 / 0.01);
    EXPECT_LT(action(rest, Director::varied, rotation).norm(), 1e-12 * scale);
  }
}

/// psi(C) of the material, and less p/2 ln det C, by the principal values of C.
double density(const Material& material, double p, const Eigen::Matrix3d& green) {
  const Eigen::Vector3d s = principal_axes(green).values;
  return energy_density(material, s[0] + s[1], s[0] * s[1], s[2]).value - p / 2 * std::log(s.prod());
}

// Shear across the wall, C_i3 = g_i, adds g shear g/2 to the energy density.
TEST(GradientKernel, TransverseShearModuliAreSecondDifferencesOfTheEnergy) {
  std::mt19937 random(6);
  int count = 0;
  double worst = 0;
  std::vector<Eigen::Vector2d> with_coincidence = stretches;
  with_coincidence.insert(
      with_coincidence.end(),
      {{given_ratio, given_ratio}, {given_ratio, 1.1}, {given_ratio * (1 + 1e-6), 1.1}, {1.02, 1.01}});
  for (const auto& [material_name, material] : test_materials()) {
    for (const auto& [rule_name, rule] : test_rules) {
      for (const Eigen::Vector2d& stretch : with_coincidence) {
        const GradientElement element = gradient_of(material, rule, random_element(random, stretch[0], stretch[1]));
        const Eigen::Matrix3d green = element.gradient.transpose() * element.gradient;
        // The pressure of the constraint balances the stress across the wall.
        const EnergyDensity psi = energy_density(material, green.topLeftCorner<2, 2>().trace(),
                                                 green.topLeftCorner<2, 2>().determinant(), green(2, 2));
        const double p = rule == ThicknessRule::incompressible ? 2 * psi.gradient[2] * green(2, 2) : 0;
        for (const Eigen::Vector2d& direction :
             {Eigen::Vector2d(1, 0), Eigen::Vector2d(0, 1), Eigen::Vector2d(0.6, 0.8)}) {
          const auto sheared = [&, &m = material](double g) {
            Eigen::Matrix3d c = green;
            c.block<2, 1>(0, 2) = g * direction;
            c.block<1, 2>(2, 0) = g * direction.transpose();
            return density(m, p, c);
          };
          const double h = 4e-3;
          const double second =
              (16 * (sheared(h) + sheared(-h)) - sheared(2 * h) - sheared(-2 * h) - 30 * sheared(0)) / (12 * h * h);
          const double error = std::abs(direction.dot(element.shear * direction) - second) / material.mu;
          EXPECT_LT(error, 1e-6) << material_name << ", " << rule_name << " at " << stretch.transpose();
          worst = std::max(worst, error);
          ++count;
        }
      }
    }
  }
  print_once("%d transverse shear moduli, worst relative difference %.1e\n", count, worst);
}

}  // namespace
}  // namespace pellicle
