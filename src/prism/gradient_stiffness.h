#pragma once

#include <Eigen/Core>
#include <vector>

#include "prism/prism_elements.h"

namespace pellicle::prism {

// The prism element as in the balloon paper (eq. 2 to 11): stress and the action of the tangent follow from the stored
// deformation gradient. With Director::varied it equals `metric_energy`, which needs fewer operations, in exact
// arithmetic. Axes of the undeformed element: those of `inverse_edges`, and its normal.

/// Treatment of the director in the tangent.
enum class Director {
  varied,   ///< stays normal: no transverse shear, and no work across the wall
  left_out  ///< as in the paper: dF has no third column, which adds a transverse shear stiffness
};

/// A deformed element, linearised.
struct GradientElement {
  Eigen::Matrix3d gradient;       ///< F = [e12 e13 d h] [e12 e13 d h]^-1, the latter undeformed (eq. 4)
  Eigen::Matrix3d stress;         ///< second Piola-Kirchhoff S, thickness eliminated by the rule [Pa]
  Eigen::Matrix3d stiffness;      ///< dS/dE in the plane, each as (11, 22, sqrt(2) 12) [Pa]
  Eigen::Matrix2d shear;          ///< transverse shear moduli: dS_i3 = 2 shear_ij dE_j3 [Pa]
  Eigen::Matrix2d inverse_edges;  ///< of the undeformed element [1/m]
  double volume;                  ///< undeformed [m^3]
};

/// @param e12, e13 deformed edges [m] @param given_ratio as for metric_energy
GradientElement gradient_element(const Material& material, ThicknessRule rule, const RestMetric& rest,
                                 const Eigen::Vector3d& e12, const Eigen::Vector3d& e13, double given_ratio);

/// K w for displacements w [m]: minus the change of the forces -V P dF/dx (eq. 8), P = F S, which is V (dF S + F dS)
/// dF/dx (eq. 11). [N]
void gradient_action(const GradientElement& element, Director director, const Eigen::Vector3d w[3],
                     Eigen::Vector3d product[3]);

/// Stiffness from the stored deformation gradient, element by element, as in the balloon paper (eq. 11), for
/// comparison.
class GradientStiffness : public ElementStiffness {
 public:
  /// Elements must outlive this object.
  GradientStiffness(const PrismElements& elements, Director director);

  void update(const Field& positions, const std::vector<double>& thickness_ratio, const std::vector<double>& pressure,
              double left_out) override;
  void add_product(double factor, const double* w, double* result) const override;
  void add_blocks(double factor, const HessianBlocks& blocks) const override;

 private:
  /// K w of an element, for its corners.
  void multiply(std::size_t element, const Eigen::Vector3d w[3], Eigen::Vector3d result[3]) const;

  const PrismElements* elements_;
  Director director_;
  std::vector<GradientElement> linearised_;  ///< of the local elements
  Eigen::Matrix3Xd positions_;               ///< of the local vertices [m]
  std::vector<double> pressure_;             ///< of the local elements [Pa], or empty
};

}  // namespace pellicle::prism
