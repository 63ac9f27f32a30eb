#pragma once

#include <petscsnes.h>

#include <functional>
#include <optional>
#include <string>

#include "base/handle.h"
#include "base/stop_signal.h"
#include "linear/ksp.h"
#include "linear/named_fields.h"

namespace pellicle::linear {

using SnesHandle = Handle<SNES, SNESDestroy>;

/// Settings of SNES for one linear solve of Newton's method: the tolerance of Eisenstat and Walker, a lagged
/// preconditioner.
struct NewtonRequest {
  double rtol = 0;
  PetscBool reuses_preconditioner = PETSC_FALSE;
};

/// Newton's step, as the line search gets it.
struct NewtonStep {
  Vec position;  ///< x
  Vec residual;  ///< f(x)
  Vec descent;   ///< y, of which x - y is the whole step
  Vec trial;
};

/// The largest share 1, 1/2, 1/4, ... of a step that lowers a merit function by a ten-thousandth of the decrease that
/// its slope predicts (Armijo); none after 20 halvings. Collective if the merit is.
/// @param merit of a fraction of the step; none where the step is not allowed
/// @param before merit at the start of the step
/// @param slope decrease of the merit per unit share at the start; 0: any decrease is enough
/// @param rounding of the merit; a rise by no more than this is accepted
inline std::optional<double> backtrack(const std::function<std::optional<double>(double fraction)>& merit,
                                       double before, double slope, double rounding) {
  constexpr int max_halvings = 20;
  constexpr double sufficient_decrease = 1e-4;
  double fraction = 1;
  for (int halvings = 0; halvings <= max_halvings; ++halvings, fraction /= 2) {
    const std::optional<double> now = merit(fraction);
    if (now && *now <= before - sufficient_decrease * fraction * slope + rounding) {
      return fraction;
    }
  }
  return std::nullopt;
}

/// The problem f(x) = 0 for Newton's method, with f the gradient of a potential. All functions are collective.
struct NewtonProblem {
  std::function<void(Vec position, Vec residual)> residual;
  /// Sets the Jacobian that `solve` uses.
  std::function<void(Vec position)> update_jacobian;
  /// Solves J y = f with the last Jacobian. If the method ends here, NewtonResult has the reason.
  std::function<LinearResult(Vec residual, Vec descent, const NewtonRequest& request)> solve;
  /// Finds the fraction of the step to take; none if no share is acceptable. Empty function: always the whole step.
  std::function<std::optional<double>(const NewtonStep& step)> search;
  /// Norm of the forces in the last residual, to which NewtonDefaults::rtol is relative. Empty: the norm of the
  /// residual at the start.
  std::function<double()> scale;
  /// Norm up to which the last residual is rounding. Empty function: NewtonDefaults::atol.
  std::function<double()> rounding;
};

/// Settings of Newton's method before the user's options are read.
struct NewtonDefaults {
  double atol = 0;
  double rtol = 1e-8;
  double stol = 1e-13;
  double ksp_rtol = 1e-6;
  int max_iterations = 50;
  NamedFields fields;       ///< of the unknowns, for the DM
  std::string own_tangent;  ///< names of the options that choose the Jacobian, for a message
};

/// Result of Newton's method.
struct NewtonResult {
  SNESConvergedReason ended = SNES_CONVERGED_ITERATING;
  int iterations = 0;
  int linear_iterations = 0;
  double residual = 0;         ///< norm at the end, as in SNES
  double start_residual = 0;   ///< norm at the start
  std::string linear_failure;  ///< message of the last linear solve
};

/// Newton's method by SNES with the problem's own linear solver, to which a KSP of prefix `<prefix>newton_` passes
/// everything on.
class Newton {
 public:
  /// Collective. @param system matrix of the Jacobian, for SNES alone @param prefix such as "prism_"
  /// @throws Error on nonlinear solvers and Jacobians that would bypass those of the problem, or that PETSc does not
  /// know
  Newton(Mat system, const std::string& prefix, NewtonProblem problem, const NewtonDefaults& defaults);
  Newton(const Newton&) = delete;  // PETSc's callbacks point to this object.
  Newton& operator=(const Newton&) = delete;

  /// Moves `position` to the last iterate, whether the method has converged or not. Collective. @throws Error that
  /// names the options when PETSc cannot follow them; Stopped, at the beginning of an iteration or in its linear solve
  NewtonResult solve(Vec position);
  /// The last residual that SNES computed; between solves the problem may overwrite it.
  Vec residual() const { return residual_; }

 private:
  struct Callbacks;

  std::string prefix_;
  NewtonProblem problem_;
  NewtonResult result_;      ///< of the solve in progress
  bool has_begun_ = false;   ///< whether the solve in progress has its first residual
  StopPoint stop_;           ///< at the beginning of an iteration
  std::string bad_options_;  ///< message of an error in the linear solver's options, from a callback
  VecHandle residual_;
  SnesHandle snes_;
};

}  // namespace pellicle::linear
