#pragma once

#include <cstddef>
#include <vector>

#include "prism/prism_elements.h"

namespace pellicle::prism {

/// Data for the stiffness of eight elements, side by side for vector instructions.
struct alignas(64) StiffnessBatch {
  static constexpr std::size_t lanes = 8;

  double e12[3][lanes];       ///< edge [m]
  double e13[3][lanes];       ///< edge [m]
  double spread[3][lanes];    ///< 2 U_1, U_2, 2 U_3, from the gradient of the energy by the metric [N/m]
  double coupling[6][lanes];  ///< from the Hessian of the energy: 4 U_11, 2 U_12, 4 U_13, U_22, 2 U_23, 4 U_33 [N/m^3]
  double load[lanes];         ///< a sixth of the pressure [Pa]
  PetscInt corner[3][lanes];  ///< local vertex number times 3
};

/// Stiffness from the metric, exact or moved to its positive part, in batches of eight elements.
///
/// With w12 = w2 - w1 and w13 = w3 - w1 the product is, for x2 and x3 (x1 gets minus their sum),
///
///     y2 = 2 U_1 w12 +   U_2 w13 + 2 q1 e12 + q2 e13      q_k = sum_l U_kl s_l
///     y3 =   U_2 w12 + 2 U_3 w13 + q2 e12 + 2 q3 e13      s = (2 e12.w12, e12.w13 + e13.w12, 2 e13.w13)
///
/// and the load's -(p/6) (w12 x e13 + e12 x w13) for each corner (add_pressure_stiffness_action).
class MetricStiffness : public ElementStiffness {
 public:
  /// Elements must outlive this object.
  explicit MetricStiffness(const PrismElements& elements);

  void update(const Field& positions, const std::vector<double>& thickness_ratio, const std::vector<double>& pressure,
              double left_out) override;
  void add_product(double factor, const double* w, double* result) const override;
  void add_blocks(double factor, const HessianBlocks& blocks) const override;

 private:
  const PrismElements* elements_;
  std::vector<StiffnessBatch> batches_;
};

}  // namespace pellicle::prism
