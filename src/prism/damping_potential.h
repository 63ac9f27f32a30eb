#pragma once

#include <vector>

#include "prism/metric_stiffness.h"
#include "prism/prism_options.h"
#include "solvers/potential.h"

namespace pellicle {
inline namespace prism {

/// Damping over a step h as a potential, (x - x^n).C (x - x^n) / (2 h) with C = mass_damping M + stiffness_damping K
/// (balloon paper, eq. 18). K is the elements' stiffness at x^n without what would give one of them negative
/// eigenvalues. Nothing here communicates.
class DampingPotential : public Potential {
 public:
  /// Elements and masses must outlive it. @param mass of the owned vertices [kg]
  DampingPotential(const PrismElements& elements, const std::vector<double>& mass, const PrismOptions& options);

  /// From here on the step is that of length h from `start`, x^n with its thicknesses.
  void begin_step(const Field& start, const std::vector<double>& thickness_ratio, double h);

  double value(const Field& x) const override;
  void add_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const override;
  std::vector<VertexPair> pattern() const override;
  void update_hessian(const Field& /*x*/, Curvature /*curvature*/) override {}
  void add_hessian(const HessianBlocks& blocks) const override;
  bool multiplies() const override { return stiffness_damping_ > 0; }
  void add_product(const double* w, double* result) const override;

 private:
  /// C (x - x^n) / h of the owned vertices [N].
  Eigen::Matrix3Xd force(const Field& x) const;

  const Membrane& membrane_;
  const std::vector<double>& mass_;
  double mass_damping_;
  double stiffness_damping_;
  double h_ = 0;
  Eigen::Matrix3Xd start_;     ///< x^n of the local vertices
  MetricStiffness stiffness_;  ///< K, if stiffness_damping is not 0
};

}  // namespace prism
}  // namespace pellicle
