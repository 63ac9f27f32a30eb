#pragma once

#include <optional>
#include <string>
#include <vector>

#include "energies/newton_options.h"
#include "energies/rigid_patches.h"
#include "energies/step_objective.h"
#include "energies/tangent_factor.h"
#include "linear/bordered_system.h"
#include "linear/newton.h"

namespace pellicle::equilibrium {

/// Result of an implicit step.
struct ImplicitResult {
  bool converged = true;
  std::string reason;  ///< message of a failure
  int newton_iterations = 0;
  int linear_iterations = 0;
  bool is_factorised = false;    ///< whether the tangent was factorised from some Newton iteration on
  int concave_iterations = 0;    ///< Newton iterations in which the tangent was not positive definite
  double residual = 0;           ///< norm of the sum of all forces at the end [N]
  double relative_residual = 0;  ///< over StepObjective::residual_scale, such as the largest norm of a kind of force
  double over_tolerance = 0;     ///< residual over the allowed one; above 1 only by rounding
  /// Whether the relative residual is above NewtonOptions::snes_rtol (with newton: fixed above residual_tolerance), and
  /// the residual is above the rounding of a surface at rest at the origin.
  bool is_above_tolerance = false;
};

/// Makes the objective of a step stationary, by SNES and KSP of prefix `prism_`: for a balloon its wall and its gas
/// (balloon paper, eq. 18 to 23; WallPart, GasFilledPart), or all objects that touch each other.
///
/// Newton's steps are halved until no element turns over in one and the objective falls (docs/theory.md); where the
/// tangent is not positive definite, until it is below the largest of its last eight values (Grippo, Lampariello and
/// Lucidi, A nonmonotone line search technique for Newton's method, SIAM J. Numer. Anal. 23, 1986), unless it rises by
/// more than 16 times what it should have fallen by. The gas's rank-one part stays low-rank beside the assembled or
/// matrix-free part.
///
/// The linear solves are by conjugate gradients with rigid patches, or with the blocks of the diagonal where patches do
/// not help. Once a solve takes more than 100 iterations the tangent is factorised (TangentFactor) for the rest of the
/// step, and for 1, 2, 4, 8 further steps each time that iterations are tried again and fail (FactorisedSteps).
///
/// Where the tangent is not positive definite, the objective has no minimum near and may have several further away. The
/// linear solver detects this: the factor has negative pivots, or conjugate gradients meet a direction of negative
/// curvature, or the solution is one. The solver's result then depends on preconditioner, ranks and rounding, and is
/// not used: the iteration is solved again with the tangent moved towards one that is positive definite by construction
/// (Curvature::psd), in eighths until it is. So the steps do not depend on the machine. The next iteration begins
/// with that fraction, less two eighths if the objective fell as the tangent predicted, and one more if it did not, as
/// a trust region grows and shrinks (Nocedal and Wright, Numerical Optimization, 2006, section 4.1): few solves are
/// repeated, and near a minimum the tangent is exact. The less the tangent is changed, the faster a step leaves a
/// saddle point.
///
/// Chambers of prescribed volume add their pressures as unknowns: a bordered system. So does the loads' time by arc
/// length: such a step is not a minimum, and its search only requires that no element turns over.
class ImplicitStep {
 public:
  /// Collective. @param objective must outlive this object
  /// @throws Error on solver options that PETSc does not know
  ImplicitStep(StepObjective& objective, const NewtonOptions& options);

  /// Moves the objective to the end of the step of length h [s] that its parts have begun, or to Newton's last iterate
  /// if the result has not converged. Collective. @param factorised of the step before; is set to that of this one
  ImplicitResult advance(double h, FactorisedSteps& factorised);

  /// Description of the linear solver, such as "cg, mg with rigid patches".
  const std::string& solver_words() const { return solver_words_; }

 private:
  void update_jacobian();
  PetscBool reuses_preconditioner(const NewtonRequest& request);
  double next_share();
  void factorise();
  LinearResult solve(Vec right_hand_side, Vec solution);
  LinearResult solve_or_factorise(Vec right_hand_side, Vec solution);
  LinearResult solve_once(Vec right_hand_side, Vec solution);
  std::optional<double> search(const NewtonStep& step);
  void judge(const NewtonResult& newton, ImplicitResult& result);
  std::string words_of_failure(const NewtonResult& newton) const;

  NewtonOptions options_;
  StepObjective& objective_;
  StepPart* along_;              ///< the part that follows arc length, or null
  std::optional<Field> before_;  ///< start of the present Newton iteration, if elements can turn over
  bool may_factorise_;           ///< whether the tangent may be factorised if iterations fail
  MatHandle positive_;           ///< a positive tangent for the preconditioner, after that of the exact one has failed
  LowRankSystem system_;         ///< of the positions
  std::optional<RigidPatches> patches_;  ///< of the preconditioner, if it is multigrid
  std::string solver_words_;
  bool is_factorised_ = false;              ///< whether the tangent is factorised in the present step
  bool has_failed_ = false;                 ///< whether iterations have failed in it
  std::optional<TangentFactor> factor_;     ///< after it has been needed
  std::optional<BorderedSystem> bordered_;  ///< of positions and pressures, if a volume is prescribed
  std::optional<LoadBorder> path_;          ///< of positions and the loads' time, if by arc length
  double linear_rtol_ = 0;                  ///< of the present solve
  double rounding_ = 0;                     ///< norm up to which a residual is rounding [N]
  bool is_direct_ = false;                  ///< whether the linear solver has no iterations
  PreconditionerLag lag_;                   ///< of the patches; without them for FarTangent::positive
  bool has_new_pattern_ = false;            ///< whether the tangent's pattern is new since the last linear solve
  int concave_iterations_ = 0;              ///< of the present step
  bool exact_serves_ = true;                ///< near the step's end, for FarTangent::positive
  double fraction_ = 0;                     ///< by which the present tangent is moved towards the positive one
  double last_ratio_ = 1;                   ///< fall of the objective in the last iteration over the predicted one
  std::vector<double> last_values_;         ///< of the objective at the start of the last Newton iterations [J]
  VecHandle unknowns_;
  std::optional<Newton> newton_;
};

}  // namespace pellicle::equilibrium
