#pragma once

#include <Eigen/Dense>
#include <random>
#include <string>
#include <vector>

#include "prism/metric_energy.h"

namespace pellicle {

/// Thickness ratio of elements whose rule does not set it.
constexpr double given_ratio = 0.85;

struct NamedMaterial {
  std::string name;
  Material material;
};

/// One material of every law, all compressible (which does not matter for the incompressible rule).
inline std::vector<NamedMaterial> test_materials(double lambda = 6e5) {
  std::vector<NamedMaterial> all(4);
  for (auto& [name, material] : all) {
    material.lambda = lambda;
  }
  all[0].name = "St. Venant-Kirchhoff";
  all[0].material.law = Choice<Material::Law>("st_venant_kirchhoff");
  all[1].name = "neo-Hookean";
  all[2].name = "Mooney-Rivlin";
  all[2].material.law = Choice<Material::Law>("mooney_rivlin");
  all[2].material.c1 = 1.8e5;
  all[2].material.c2 = 0.2e5;
  all[3].name = "Ogden";
  all[3].material.law = Choice<Material::Law>("ogden");
  all[3].material.ogden_mu = {6.3e5, 1.2e3, -1e4};
  all[3].material.ogden_alpha = {1.3, 5, -2};
  return all;
}

struct NamedRule {
  std::string name;
  ThicknessRule rule;
};

inline const std::vector<NamedRule> test_rules{{"fixed", ThicknessRule::fixed},
                                               {"incompressible", ThicknessRule::incompressible},
                                               {"plane stress", ThicknessRule::plane_stress}};

/// An element before and after a deformation.
struct TestElement {
  Eigen::Vector3d rest12, rest13;  ///< [m]
  Eigen::Vector3d e12, e13;        ///< [m]
  double thickness = 3e-4;         ///< [m]

  RestMetric rest() const { return rest_metric(rest12, rest13, thickness); }
  Eigen::Vector3d metric() const { return pellicle::metric(e12, e13); }
};

inline Eigen::Matrix3d random_rotation(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
      .normalized()
      .toRotationMatrix();
}

/// A well-shaped element of size 1 cm, turned at random, with principal stretches along random axes of its plane.
inline TestElement random_element(std::mt19937& random, double stretch1, double stretch2) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  Eigen::Matrix<double, 3, 2> rest;
  rest << 1 + 0.2 * uniform(random), 0.3 * uniform(random), 0.2 * uniform(random), 1 + 0.2 * uniform(random), 0, 0;
  rest *= 0.01;
  const Eigen::Rotation2Dd axes(3 * uniform(random));
  const Eigen::Matrix2d stretch =
      axes.toRotationMatrix() * Eigen::Vector2d(stretch1, stretch2).asDiagonal() * axes.inverse().toRotationMatrix();
  Eigen::Matrix<double, 3, 2> deformed = rest;
  deformed.topRows<2>() = stretch * rest.topRows<2>();
  rest = random_rotation(random) * rest;
  deformed = random_rotation(random) * deformed;
  return {rest.col(0), rest.col(1), deformed.col(0), deformed.col(1)};
}

/// dU/dx of the three vertices from dU/da.
inline Eigen::Matrix<double, 9, 1> gradient_of_vertices(const Eigen::Vector3d& by_metric, const TestElement& element) {
  Eigen::Matrix<double, 9, 1> result;
  result.segment<3>(3) = 2 * by_metric[0] * element.e12 + by_metric[1] * element.e13;
  result.segment<3>(6) = by_metric[1] * element.e12 + 2 * by_metric[2] * element.e13;
  result.head<3>() = -result.segment<3>(3) - result.segment<3>(6);
  return result;
}

/// K = d2U/dx2 of the three vertices from gradient and Hessian by the metric. [N/m]
inline Eigen::Matrix<double, 9, 9> element_matrix(const MetricEnergy& tangent, const TestElement& element) {
  const Eigen::Vector3d& e12 = element.e12;
  const Eigen::Vector3d& e13 = element.e13;
  // By the edges (e12, e13) first: da = B (de12, de13), and the second derivatives of a weighted by the gradient.
  Eigen::Matrix<double, 3, 6> b;
  b << 2 * e12.transpose(), Eigen::RowVector3d::Zero(),  //
      e13.transpose(), e12.transpose(),                  //
      Eigen::RowVector3d::Zero(), 2 * e13.transpose();
  const Eigen::Vector3d& g = tangent.gradient;
  Eigen::Matrix<double, 6, 6> by_edges = b.transpose() * (tangent.hessian * b);
  for (int i = 0; i < 3; ++i) {
    by_edges(i, i) += 2 * g[0];
    by_edges(i, i + 3) += g[1];
    by_edges(i + 3, i) += g[1];
    by_edges(i + 3, i + 3) += 2 * g[2];
  }
  // e12 = x2 - x1, e13 = x3 - x1: forces and displacements of x1 are minus the sums.
  Eigen::Matrix<double, 9, 9> k;
  k.bottomRightCorner<6, 6>() = by_edges;
  k.topRightCorner<3, 6>() = -by_edges.topRows<3>() - by_edges.bottomRows<3>();
  k.leftCols<3>() = -k.middleCols<3>(3) - k.rightCols<3>();
  return k;
}

/// The in-plane second Piola-Kirchhoff stress from dU/da, in the axes of `inverse_edges`. [Pa]
inline Eigen::Matrix2d in_plane_stress(const Eigen::Vector3d& by_metric, const RestMetric& rest) {
  const Eigen::Matrix2d edges = inverse_edges(rest).inverse();
  Eigen::Matrix2d g;
  g << by_metric[0], by_metric[1] / 2, by_metric[1] / 2, by_metric[2];
  return 2 / rest.volume * edges * g * edges.transpose();
}

}  // namespace pellicle
