#pragma once

#include <Eigen/Core>

#include "prism/material.h"

namespace pellicle::prism {

// The prism element (balloon paper, section 4) through its metric. The director is the unit normal of the triangle, so
// that F^T F has the in-plane block given by the edges and the entry c = (h/h0)^2 across the wall, and no others;
// energy, forces and tangent follow from U(a), a = (e12.e12, e12.e13, e13.e13), exactly, the director's derivatives
// included.

/// Rule for the wall's thickness while the element deforms.
enum class ThicknessRule {
  fixed,           ///< c is given, also for the paper's "global" rule: c is no unknown of the solve
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

/// R = [e12 e13]^-1 of the undeformed edges in orthonormal axes of their plane, the first along e12: upper triangular.
/// The in-plane deformation gradient in these axes is [e12 e13] R of the deformed edges. [1/m]
Eigen::Matrix2d inverse_edges(const RestMetric& rest);

/// The in-plane right Cauchy-Green tensor in the axes of `inverse_edges`, as (C11, C22, sqrt(2) C12), is this matrix
/// times a. [1/m^2]
Eigen::Matrix3d cauchy_green_of_metric(const RestMetric& rest);

/// a of the edges e12, e13 [m^2].
inline Eigen::Vector3d metric(const Eigen::Vector3d& e12, const Eigen::Vector3d& e13) {
  return {e12.squaredNorm(), e12.dot(e13), e13.squaredNorm()};
}

/// Highest derivatives of an element's energy to compute.
enum class Derivatives { first, second };

/// Energy of an element and its derivatives by a = (e12.e12, e12.e13, e13.e13), the thickness eliminated by the rule.
struct MetricEnergy {
  double energy = 0;           ///< U [J]
  Eigen::Vector3d gradient;    ///< dU/da [J/m^2]
  Eigen::Matrix3d hessian;     ///< d2U/da2 [J/m^4], symmetric; of Derivatives::second only
  double thickness_ratio = 1;  ///< h/h0 = sqrt(c)
};

/// Energy of an element. For a material that wrinkles it is the relaxed energy of tension-field theory, for a wall too
/// thin to bear compression (Pipkin, The relaxed energy density for isotropic elastic membranes, IMA J. Appl. Math. 36,
/// 1986; Steigmann, Tension-field theory, Proc. R. Soc. Lond. A 429, 1990). Let l1 >= l2 be the principal stretches,
/// and w(l1) the l2 of uniaxial tension. If l2 >= w (taut) the energy is not changed; if l1 > 1 and l2 < w (wrinkled)
/// it is the energy at (l1, w); if l1 <= 1 and l2 < w (slack) it is 0 with its derivatives. The thickness is that of
/// the wall in its wrinkles. Not available for a given thickness ratio other than 1. Material::tension T adds T (tr C -
/// 2)/2, a second Piola-Kirchhoff stress T in all directions, so that no state is without stiffness.
///
/// The energy is infinite and its derivatives are not finite if the element has collapsed (no area) or, for
/// plane_stress, no thickness gives zero stress across the wall.
/// @param given_ratio h/h0 for ThicknessRule::fixed; a starting value for plane_stress
MetricEnergy metric_energy(const Material& material, ThicknessRule rule, const RestMetric& rest,
                           const Eigen::Vector3d& a, double given_ratio, Derivatives order = Derivatives::second);

/// Operations of metric_energy, counted as in energy_density_flops; those of the search for the thickness of
/// plane_stress are left out.
int metric_energy_flops(const Material& material, ThicknessRule rule, Derivatives order);

/// The energy with that part of its derivatives that keeps every element positive semi-definite: the geometric
/// stiffness uses the gradient without compressive principal stresses (second Piola-Kirchhoff), and the Hessian, as
/// stiffness in orthonormal undeformed axes, has no negative eigenvalues. Without compression and negative eigenvalues
/// it is the exact tangent.
MetricEnergy positive_part(const MetricEnergy& energy, const RestMetric& rest);

/// Principal stretches and stresses of an element, the larger stretch first.
struct PrincipalState {
  Eigen::Vector2d stretch;  ///< length over undeformed length
  Eigen::Vector2d stress;   ///< Cauchy stress in the plane of the wall [Pa]
};

/// @param e12, e13 deformed edges [m]
/// @param thickness_ratio h/h0, as for metric_energy
PrincipalState principal_state(const Material& material, ThicknessRule rule, const RestMetric& rest,
                               const Eigen::Vector3d& e12, const Eigen::Vector3d& e13, double thickness_ratio);

/// Cauchy stress times present thickness [N/m].
/// @param gradient of the elastic energy by the metric (MetricEnergy) [N]
Eigen::Matrix3d tension(const Eigen::Vector3d& gradient, const Eigen::Vector3d& e12, const Eigen::Vector3d& e13);

}  // namespace pellicle::prism
