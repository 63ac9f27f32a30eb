#pragma once

#include <vector>

#include "base/handle.h"
#include "base/stage_result.h"
#include "heat/diffusion_graph.h"
#include "heat/heat_options.h"
#include "parallel/field.h"
#include "surface/active_set.h"
#include "surface/surface.h"

namespace pellicle::heat {

/// Data of a step for conduction, with ghosts up to date.
struct ConductionInput {
  const Field& positions;   ///< [m], (3 x local)
  const Field& mass;        ///< [kg], (1 x local); used by the consistent operator alone
  const ActiveSet& active;  ///< triangles and springs that have not burnt
  double time_step = 0;     ///< h [s]
};

/// Heat conduction over all particles of a surface by backward Euler (burning paper, eq. 2, 3 and section 5):
/// (capacity + h K) (T^{n+1} - T^n) = -h K T^n, a symmetric positive definite system for CG.
///
/// The residual r that the linear solver leaves is given to the particles as r / capacity, so that heat flows from one
/// particle to another and none is made or lost, whatever the tolerance of the solver: sum_i capacity_i T_i stays
/// constant to rounding. While some r_i / capacity_i exceeds `heat.ksp_rtol` times the range of temperatures, and
/// rounding, the system is solved for r again.
///
/// A particle without active neighbours keeps its temperature. The matrix is assembled (pattern once, values each step)
/// or matrix-free; KSP prefix `heat_`.
class Conduction {
 public:
  /// @param surface must outlive this object
  /// @param diffusivity_factor factor on `heat.diffusivity` of each local particle, or empty for 1. Collective.
  Conduction(const Surface& surface, const HeatOptions& options, const std::vector<double>& diffusivity_factor);
  Conduction(const Conduction&) = delete;  // The shell matrix points to this object.
  Conduction& operator=(const Conduction&) = delete;

  /// Advances the temperatures by a step; they do not change if the linear solve fails. @returns the iterations of all
  /// solves and, on failure, the reason. Collective.
  StageResult advance(Field& temperature, const ConductionInput& input);

 private:
  void create_assembled();
  void update_operator(const ConductionInput& input);
  /// (capacity + h K) x of the owned rows, both (owned). Collective.
  void multiply(const double* x, double* product);
  void multiply_vector(Vec x, Vec product);
  void copy_diagonal(Vec out) const;
  /// Largest allowed residual of a particle's balance, as a change of its temperature [K]. Collective.
  double limit_of_remainder(const Field& temperature) const;

  const Surface& surface_;
  HeatOptions options_;
  bool assembled_;
  std::vector<double> diffusivity_;  ///< alpha of the local particles [m^2/s]
  DiffusionGraph graph_;             ///< weights times h
  Eigen::VectorXd diagonal_;         ///< of the owned rows
  Eigen::VectorXd sum_;              ///< over the pairs of each local particle
  Eigen::VectorXd remainder_;        ///< residual of the owned particles' heat, or of their temperatures
  Eigen::VectorXd product_;          ///< of the owned rows
  std::vector<double> entries_;      ///< of the assembled matrix, in the order of its coordinates
  Field exchange_;                   ///< an operand with its ghosts
  Field estimate_;                   ///< of the temperatures at the end of the step
  MatHandle matrix_;
  VecHandle right_hand_side_;
  VecHandle increment_;
  KspHandle ksp_;
};

}  // namespace pellicle::heat
