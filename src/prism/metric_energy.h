#pragma once

#include <Eigen/Core>

#include "prism/material.h"

namespace pellicle {

// The prism element (balloon paper, section 4) through its metric. The director is the unit normal of the triangle, so
// that F^T F has the in-plane block given by the edges and the entry c = (h/h0)^2 across the wall, and no others; energy,
// forces and tangent follow from U(a), a = (e12.e12, e12.e13, e13.e13), exactly, the director's derivatives included.

/// What becomes of the wall's thickness while the element deforms.
enum class ThicknessRule {
  fixed,           ///< c given (also the paper's way, "global": c is no unknown of the solve)
  incompressible,  ///< the element keeps its volume: c = 1/det of the in-plane block
  plane_stress     ///< the stress across the wall vanishes: dpsi/dc = 0
};

/// The undeformed element.
struct RestMetric {
  Eigen::Vector3d inverse;  ///< inverse of the metric of the undeformed edges: entries 11, 12, 22 [1/m^2]
  double area = 0;          ///< [m^2]
  double volume = 0;        ///< area times undeformed thickness [m^3]
};

/// @param e12, e13 undeformed edges [m] @param thickness undeformed [m]
RestMetric rest_metric(const Eigen::Vector3d& e12, const Eigen::Vector3d& e13, double thickness);

/// Energy of an element and its derivatives by a = (e12.e12, e12.e13, e13.e13), the thickness eliminated by the rule.
struct MetricEnergy {
  double energy = 0;            ///< U [J]
  Eigen::Vector3d gradient;     ///< dU/da [J/m^2]
  Eigen::Matrix3d hessian;      ///< d2U/da2 [J/m^4], symmetric
  double thickness_ratio = 1;   ///< h/h0 = sqrt(c)
};

/// @param given_ratio h/h0 for ThicknessRule::fixed; a starting value for plane_stress
/// Not finite where the element has collapsed (no area) or, for plane_stress, no thickness balances it.
MetricEnergy metric_energy(const Material& material, ThicknessRule rule, const RestMetric& rest,
                           const Eigen::Vector3d& a, double given_ratio);

/// The part of the tangent that keeps every element positive semi-definite: for the geometric stiffness the gradient
/// with compressive principal stresses (second Piola-Kirchhoff, undeformed frame) left out, and the Hessian without
/// negative eigenvalues. @returns gradient and hessian to use in place of the exact ones
struct MetricTangent {
  Eigen::Vector3d gradient;
  Eigen::Matrix3d hessian;
};
MetricTangent positive_part(const MetricEnergy& energy, const RestMetric& rest);

/// Element matrix K = d2U/dx2 of the vertices (x1, x2, x3), (9 x 9) [N/m], from gradient and Hessian by a.
Eigen::Matrix<double, 9, 9> element_matrix(const MetricTangent& tangent, const Eigen::Vector3d& e12,
                                           const Eigen::Vector3d& e13);

}  // namespace pellicle
