#pragma once

#include <Eigen/Core>
#include <vector>

#include "prism/element_stiffness.h"
#include "prism/gradient_kernel.h"
#include "prism/prism_elements.h"

namespace pellicle {
inline namespace prism {

/// Stiffness from the stored deformation gradient, element by element, as in the balloon paper (eq. 11), for
/// comparison.
class GradientStiffness : public ElementStiffness {
 public:
  /// Elements must outlive this object.
  GradientStiffness(const PrismElements& elements, Director director);

  void update(const Field& positions, const std::vector<double>& thickness_ratio,
              const std::vector<double>& pressure) override;
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

}  // namespace prism
}  // namespace pellicle
