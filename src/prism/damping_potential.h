#pragma once

#include <vector>

#include "energies/potential.h"
#include "prism/metric_stiffness.h"
#include "prism/prism_options.h"

namespace pellicle::prism {

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
  void add_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const override;
  std::vector<VertexPair> pattern() const override;
  void update_hessian(const Field& /*x*/, double /*psd_blend*/) override {}
  void add_hessian(const HessianBlocks& blocks) const override;
  bool multiplies() const override { return stiffness_damping_ > 0; }
  void add_product(const double* w, double* result) const override;

 private:
  /// c C (x - x_v) of the owned vertices [N].
  Eigen::Matrix3Xd force(const Field& x) const;

  const Membrane& membrane_;
  const std::vector<double>& mass_;
  double mass_damping_;
  double stiffness_damping_;
  double rate_ = 0;            ///< c [1/s]
  Eigen::Matrix3Xd y_v_;       ///< x_v of the local vertices
  MetricStiffness stiffness_;  ///< K, if stiffness_damping is not 0
};

}  // namespace pellicle::prism
