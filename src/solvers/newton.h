#pragma once

#include <petscsnes.h>

#include <functional>
#include <optional>
#include <string>

#include "base/handle.h"
#include "base/stop_signal.h"
#include "solvers/ksp.h"
#include "solvers/named_fields.h"

namespace pellicle {
inline namespace solvers {

using SnesHandle = Handle<SNES, SNESDestroy>;

/// What SNES sets for one linear solve of Newton's method: the tolerance of Eisenstat and Walker, a lagged
/// preconditioner.
struct NewtonRequest {
  double rtol = 0;
  PetscBool reuses_preconditioner = PETSC_FALSE;
};

/// Newton's step as the line search gets it. The search may overwrite `trial`.
struct NewtonStep {
  Vec position;  ///< x
  Vec residual;  ///< f(x)
  Vec descent;   ///< y, of which x - y is the whole step
  Vec trial;
};

/// f(x) = 0, f the gradient of a potential, as Newton's method asks for it. All collective.
struct NewtonProblem {
  std::function<void(Vec position, Vec residual)> residual;
  /// Sets the Jacobian, in whatever form `solve` wants it.
  std::function<void(Vec position)> update_jacobian;
  /// J y = f at the position of the last Jacobian. If it fails, the last result has the reason.
  std::function<LinearResult(Vec residual, Vec descent, const NewtonRequest& request)> solve;
  /// Share of the step to take; nothing if no share is acceptable. Empty function: always the whole step.
  std::function<std::optional<double>(const NewtonStep& step)> search;
  /// What NewtonDefaults::rtol is relative to where the residual was last asked for, a norm of the forces that are to
  /// be in balance. Empty: the norm of the residual at the start.
  std::function<double()> scale;
  /// Norm of a residual that is rounding alone. Empty function: NewtonDefaults::atol.
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
  std::string own_tangent;  ///< the options that choose the Jacobian, for a message
};

/// How Newton's method ended.
struct NewtonResult {
  SNESConvergedReason ended = SNES_CONVERGED_ITERATING;
  int iterations = 0;
  int linear_iterations = 0;
  double residual = 0;         ///< norm where it ended, as SNES has it
  double start_residual = 0;   ///< norm where it began
  std::string linear_failure;  ///< of the last linear solve, in words
};

/// Newton's method by SNES, whose linear solver is the problem's own: SNES sees a KSP of prefix `<prefix>newton_` that
/// passes everything on.
class Newton {
 public:
  /// Collective. @param system matrix of the Jacobian, for SNES alone @param prefix such as "prism_"
  /// @throws Error on nonlinear solvers and Jacobians that would bypass those of the problem, or that PETSc does not
  /// know
  Newton(Mat system, const std::string& prefix, NewtonProblem problem, const NewtonDefaults& defaults);
  Newton(const Newton&) = delete;  // PETSc's callbacks point to this object.
  Newton& operator=(const Newton&) = delete;

  /// Moves `position` to where the method ends, whether that is a solution or not. Collective. @throws Error that names
  /// the options when PETSc cannot do as they say; Stopped, at the beginning of an iteration or in its linear solve
  NewtonResult solve(Vec position);
  /// The residual where it was last asked for; between solves the problem may overwrite it.
  Vec residual() const { return residual_; }

 private:
  static PetscErrorCode residual_callback(SNES snes, Vec position, Vec residual, void* context);
  static PetscErrorCode jacobian_callback(SNES snes, Vec position, Mat amat, Mat pmat, void* context);
  static PetscErrorCode solve_callback(PC pc, Vec residual, Vec descent);
  static PetscErrorCode search_callback(SNESLineSearch search, void* context);
  static PetscErrorCode convergence_callback(SNES snes, PetscInt iteration, PetscReal position_norm,
                                             PetscReal step_norm, PetscReal norm, SNESConvergedReason* reason,
                                             void* context);
  bool search(SNESLineSearch search);

  std::string prefix_;
  NewtonProblem problem_;
  NewtonResult result_;      ///< of the solve in progress
  bool has_begun_ = false;   ///< it has a first residual
  StopPoint stop_;           ///< at the beginning of an iteration
  std::string bad_options_;  ///< why the linear solver cannot work as the options say, found in a callback
  VecHandle residual_;
  SnesHandle snes_;
};

}  // namespace solvers
}  // namespace pellicle
