#include "linear/newton.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "base/error.h"

namespace pellicle::linear {

namespace {

/// Refuses nonlinear solvers and Jacobians that would bypass those of the problem, or its line search.
void require_known(const std::string& prefix, const std::string& own_tangent) {
  const std::string type = option_value("-" + prefix + "snes_type").value_or(SNESNEWTONLS);
  const std::vector<std::string> known{SNESNEWTONLS, SNESNEWTONTR, SNESKSPONLY};
  if (std::find(known.begin(), known.end(), type) == known.end()) {
    throw Error("-" + prefix + "snes_type " + type +
                ": an implicit step is Newton's method with its own tangent, expected newtonls, newtontr or ksponly");
  }
  for (const char* option : {"-snes_mf", "-snes_mf_operator", "-snes_fd", "-snes_fd_color"}) {
    PetscBool is_set = PETSC_FALSE;
    check(PetscOptionsGetBool(nullptr, prefix.c_str(), option, &is_set, nullptr));
    if (is_set == PETSC_TRUE) {
      throw Error("-" + prefix + (option + 1) + ": an implicit step has its own tangent, expected " + own_tangent);
    }
  }
}

}  // namespace

/// The functions that PETSc calls; the context of each is the Newton object.
struct Newton::Callbacks {
  static PetscErrorCode residual(SNES, Vec position, Vec residual, void* context) {
    return as_petsc_callback([&] {
      auto& self = *static_cast<Newton*>(context);
      self.problem_.residual(position, residual);
      if (!std::exchange(self.has_begun_, true)) {
        check(VecNorm(residual, NORM_2, &self.result_.start_residual));
      }
    });
  }

  static PetscErrorCode jacobian(SNES, Vec position, Mat, Mat, void* context) {
    return as_petsc_callback([&] { static_cast<Newton*>(context)->problem_.update_jacobian(position); });
  }

  static PetscErrorCode solve(PC pc, Vec residual, Vec descent) {
    return as_petsc_callback([&] {
      Newton* self = nullptr;
      KSP outer = nullptr;
      NewtonRequest request;
      check(PCShellGetContext(pc, &self));
      check(SNESGetKSP(self->snes_, &outer));
      check(KSPGetTolerances(outer, &request.rtol, nullptr, nullptr, nullptr));
      check(KSPGetReusePreconditioner(outer, &request.reuses_preconditioner));
      LinearResult solved;
      try {
        solved = self->problem_.solve(residual, descent, request);
      } catch (const Stopped&) {
        check(PCSetFailedReason(pc, PC_SUBPC_ERROR));  // SNES ends, and `solve` leaves off.
        return;
      } catch (const Error& error) {
        self->bad_options_ = error.what();
        throw;
      }
      self->result_.linear_iterations += solved.iterations;
      self->result_.linear_failure = solved.reason;
      check(PCSetFailedReason(pc, solved.converged ? PC_NOERROR : PC_SUBPC_ERROR));
    });
  }

  static PetscErrorCode search(SNESLineSearch search, void* context) {
    return as_petsc_callback([&] {
      SNES snes = nullptr;
      NewtonStep step{};
      check(SNESLineSearchGetVecs(search, &step.position, &step.residual, &step.descent, &step.trial, nullptr));
      check(SNESLineSearchGetSNES(search, &snes));
      const std::optional<double> fraction = static_cast<Newton*>(context)->problem_.search(step);
      if (fraction) {
        check(VecWAXPY(step.trial, -*fraction, step.descent, step.position));
        check(VecCopy(step.trial, step.position));
        check(SNESComputeFunction(snes, step.position, step.residual));
        check(SNESLineSearchSetLambda(search, *fraction));
        check(SNESLineSearchComputeNorms(search));
      }
      check(SNESLineSearchSetReason(search, fraction ? SNES_LINESEARCH_SUCCEEDED : SNES_LINESEARCH_FAILED_REDUCT));
    });
  }

  /// Like SNESConvergedDefault, but with the problem's scale in place of the norm at the start, and with its rounding;
  /// also ends the method at a StopPoint.
  static PetscErrorCode convergence(SNES snes, PetscInt iteration, PetscReal position_norm, PetscReal step_norm,
                                    PetscReal norm, SNESConvergedReason* reason, void* context) {
    return as_petsc_callback([&] {
      check(SNESConvergedDefault(snes, iteration, position_norm, step_norm, norm, reason, nullptr));
      auto& self = *static_cast<Newton*>(context);
      const NewtonProblem& problem = self.problem_;
      if (*reason == SNES_CONVERGED_ITERATING && problem.rounding && norm <= problem.rounding()) {
        *reason = SNES_CONVERGED_FNORM_ABS;
      }
      if (problem.scale && (*reason == SNES_CONVERGED_ITERATING || *reason == SNES_CONVERGED_FNORM_RELATIVE)) {
        PetscReal rtol = 0;
        PetscReal stol = 0;
        check(SNESGetTolerances(snes, nullptr, &rtol, &stol, nullptr, nullptr));
        if (norm <= rtol * problem.scale()) {
          *reason = SNES_CONVERGED_FNORM_RELATIVE;
        } else {
          *reason = step_norm < stol * position_norm ? SNES_CONVERGED_SNORM_RELATIVE : SNES_CONVERGED_ITERATING;
        }
      }
      if (*reason == SNES_CONVERGED_ITERATING && self.stop_.pass()) {
        *reason = SNES_DIVERGED_INNER;  // `solve` leaves off.
      }
    });
  }
};

Newton::Newton(Mat system, const std::string& prefix, NewtonProblem problem, const NewtonDefaults& defaults)
    : prefix_(prefix), problem_(std::move(problem)) {
  require_known(prefix, defaults.own_tangent);
  KSP outer = nullptr;
  check(SNESCreate(comm_of(system), snes_.create()));
  check(SNESSetOptionsPrefix(snes_, prefix.c_str()));
  check(SNESGetKSP(snes_, &outer));  // Its own: in one that it is given Eisenstat and Walker's tolerances are not set.
  check(KSPSetOptionsPrefix(outer, (prefix + "newton_").c_str()));
  check(KSPSetType(outer, KSPPREONLY));
  check(KSPSetTolerances(outer, defaults.ksp_rtol, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT));
  const PC pc = preconditioner_of(outer);
  check(PCSetType(pc, PCSHELL));
  check(PCShellSetContext(pc, this));
  check(PCShellSetApply(pc, Callbacks::solve));
  check(SNESSetDM(snes_, make_dm(system, prefix, defaults.fields)));
  check(MatCreateVecs(system, residual_.create(), nullptr));
  check(SNESSetJacobian(snes_, system, system, Callbacks::jacobian, this));
  check(SNESSetFunction(snes_, residual_, Callbacks::residual, this));
  check(SNESSetTolerances(snes_, defaults.atol, defaults.rtol, defaults.stol, defaults.max_iterations, PETSC_DEFAULT));
  SNESLineSearch search = nullptr;
  check(SNESGetLineSearch(snes_, &search));
  check(SNESLineSearchSetType(search, problem_.search ? SNESLINESEARCHSHELL : SNESLINESEARCHBASIC));
  if (problem_.search) {
    check(SNESLineSearchShellSetUserFunc(search, Callbacks::search, this));
  }
  check(SNESSetConvergenceTest(snes_, Callbacks::convergence, this, nullptr));
  run_solver(prefix, [&] { check(SNESSetFromOptions(snes_)); });
}

NewtonResult Newton::solve(Vec position) {
  result_ = {};
  has_begun_ = false;
  bad_options_.clear();
  try {
    run_solver(prefix_, [&] { check(SNESSolve(snes_, nullptr, position)); });
  } catch (const std::runtime_error&) {
    leave_if_stopped();
    if (!bad_options_.empty()) {
      throw Error(bad_options_);
    }
    throw;
  }
  leave_if_stopped();
  PetscInt iterations = 0;
  check(SNESGetConvergedReason(snes_, &result_.ended));
  check(SNESGetIterationNumber(snes_, &iterations));
  check(SNESGetFunctionNorm(snes_, &result_.residual));
  result_.iterations = static_cast<int>(iterations);
  return result_;
}

}  // namespace pellicle::linear
