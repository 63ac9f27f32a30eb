#include "linear/preconditioner_lag.h"

#include <algorithm>

#include "base/error.h"

namespace pellicle {
inline namespace linear {

namespace {

/// Number of iterations that costs about as much as a new preconditioner.
constexpr PetscInt worth_renewing = 50;

}  // namespace

bool PreconditionerLag::due(KSP solver) {
  PetscInt iterations = 0;
  KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
  check(KSPGetIterationNumber(solver, &iterations));
  check(KSPGetConvergedReason(solver, &reason));
  if (has_one_ && reason > 0) {
    fewest_iterations_ = std::min(fewest_iterations_, iterations);
    wasted_iterations_ += iterations - fewest_iterations_;
    return wasted_iterations_ >= worth_renewing;
  }
  return true;
}

void PreconditionerLag::renewed() {
  has_one_ = true;
  fewest_iterations_ = PETSC_MAX_INT;
  wasted_iterations_ = 0;
}

}  // namespace linear
}  // namespace pellicle
