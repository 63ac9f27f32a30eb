#pragma once

#include <array>
#include <memory>
#include <vector>

#include "energies/potential.h"
#include "prism/metric_stiffness.h"
#include "prism/prism_elements.h"
#include "prism/prism_options.h"

namespace pellicle::prism {

/// The pairs of corners of a surface's local triangles, nine for each, in the order of ElementStiffness::add_blocks.
std::vector<VertexPair> pairs_of_elements(const Surface& surface);

/// The elastic energy of the wall. Its exact Hessian includes the stiffness of the pressure on the elements, which the
/// same kernels add. The positive one is that of MetricStiffness, without the pressure's. No communication.
class WallPotential : public Potential {
 public:
  /// Elements must outlive this object.
  WallPotential(const PrismElements& elements, const PrismOptions& options);

  /// Sets the thickness ratios from which PrismElements::energy starts.
  void set_thickness(const std::vector<double>& ratio) { thickness_ratio_ = ratio; }
  /// @param pressure on the local elements, whose load stiffness is included [Pa], or empty
  /// @param rims sides of local elements without a neighbour under the same pressure (3 times the element plus the
  /// corner where the side begins)
  void set_load(std::vector<double> pressure, std::vector<PetscInt> rims = {});

  /// Whether the exact Hessian can be moved towards the positive one by a fraction.
  bool blends() const { return blended_ != nullptr; }

  double value(const Field& x) const override { return elements_.energy(x, thickness_ratio_); }
  void add_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const override { add_value_and_gradient(x, gradient); }
  double add_value_and_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const override;
  std::vector<VertexPair> pattern() const override { return pairs_of_elements(elements_.membrane()); }
  /// @param psd_blend fraction of compression and of the pressure's stiffness that is left out; only 0 or 1 unless it
  /// `blends`
  void update_hessian(const Field& x, double psd_blend) override;
  void add_hessian(const HessianBlocks& blocks) const override;
  bool multiplies() const override { return true; }
  void add_product(const double* w, double* result) const override;

 private:
  const PrismElements& elements_;
  MetricStiffness* blended_ = nullptr;  ///< `exact_` if it can be moved by a fraction, else null
  std::unique_ptr<ElementStiffness> exact_;
  MetricStiffness positive_;
  const ElementStiffness* in_use_;  ///< one of the two
  std::vector<double> thickness_ratio_;
  std::vector<double> pressure_;
  std::vector<PetscInt> rims_;
  std::vector<Eigen::Matrix3d> at_rims_;  ///< rim_stiffness of each rim; empty if the positive Hessian is in use
};

}  // namespace pellicle::prism
