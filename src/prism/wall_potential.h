#pragma once

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
  bool blends() const { return blends_; }

  double value(const Field& x) const override { return elements_.energy(x, thickness_ratio_); }
  void add_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const override { add_value_and_gradient(x, gradient); }
  double add_value_and_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const override {
    return elements_.add_gradient(x, thickness_ratio_, gradient);
  }
  std::vector<VertexPair> pattern() const override { return pairs_of_elements(elements_.membrane()); }
  /// @param psd_blend fraction of compression and of the pressure's stiffness that is left out; only 0 or 1 unless it
  /// `blends`
  void update_hessian(const Field& x, double psd_blend) override;
  void add_hessian(const HessianBlocks& blocks) const override;
  bool multiplies() const override { return true; }
  void add_product(const double* w, double* result) const override;

 private:
  const PrismElements& elements_;
  bool blends_;
  std::unique_ptr<ElementStiffness> exact_;
  MetricStiffness positive_;
  const ElementStiffness* in_use_;  ///< one of the two
  std::vector<double> thickness_ratio_;
  std::vector<double> pressure_;
  std::vector<PetscInt> rims_;
  std::vector<Eigen::Matrix3d> at_rims_;  ///< rim_stiffness of each rim; empty if the positive Hessian is in use
};

/// Damping in a step as a potential, c (x - x_v).C (x - x_v) / 2, where c (x - x_v) is the velocity and C =
/// mass_damping M + stiffness_damping K (balloon paper, eq. 18). K is the elements' stiffness at positions fixed in the
/// step, without the part that would give an element negative eigenvalues. No communication.
class DampingPotential : public Potential {
 public:
  /// Elements and masses must outlive it. @param mass of the owned vertices [kg]
  DampingPotential(const PrismElements& elements, const std::vector<double>& mass, const PrismOptions& options);

  /// Begins a step. @param at positions for K, with thicknesses @param still x_v of the local vertices [m]
  /// @param rate c [1/s]
  void begin_step(const Field& at, const std::vector<double>& thickness_ratio, const Eigen::Matrix3Xd& still,
                  double rate);

  double value(const Field& x) const override;
  void add_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const override { add_value_and_gradient(x, gradient); }
  double add_value_and_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const override;
  std::vector<VertexPair> pattern() const override;
  void update_hessian(const Field& /*x*/, double /*psd_blend*/) override {}
  void add_hessian(const HessianBlocks& blocks) const override;
  bool multiplies() const override { return stiffness_damping_ > 0; }
  void add_product(const double* w, double* result) const override;

 private:
  const Membrane& membrane_;
  const std::vector<double>& mass_;
  double mass_damping_;
  double stiffness_damping_;
  double rate_ = 0;            ///< c [1/s]
  Eigen::Matrix3Xd y_v_;       ///< x_v of the local vertices
  MetricStiffness stiffness_;  ///< K, if stiffness_damping is not 0
};

}  // namespace pellicle::prism
