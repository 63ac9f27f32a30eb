#pragma once

#include <petscksp.h>

#include <algorithm>

#include "base/error.h"

namespace pellicle::linear {

/// Decides when a preconditioner is renewed while its matrix changes: when the iterations of its solves beyond those of
/// the shortest solve have cost as much as a new one.
class PreconditionerLag {
 public:
  /// Whether a new preconditioner is due: there is none yet, the last solve failed, or solves have become slow. To be
  /// called once after each solve.
  bool due(KSP solver) {
    constexpr PetscInt worth_renewing = 50;  // iterations that cost about as much as a new preconditioner
    PetscInt iterations = 0;
    KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
    check(KSPGetIterationNumber(solver, &iterations));
    check(KSPGetConvergedReason(solver, &reason));
    if (!has_one_ || reason <= 0) {
      return true;
    }
    fewest_iterations_ = std::min(fewest_iterations_, iterations);
    wasted_iterations_ += iterations - fewest_iterations_;
    return wasted_iterations_ >= worth_renewing;
  }

  /// Notes that the preconditioner has been renewed.
  void renewed() {
    has_one_ = true;
    fewest_iterations_ = PETSC_MAX_INT;
    wasted_iterations_ = 0;
  }

  /// Notes that the present preconditioner has become useless.
  void forget() { has_one_ = false; }

 private:
  bool has_one_ = false;
  PetscInt fewest_iterations_ = 0;  ///< of a solve with the present preconditioner
  PetscInt wasted_iterations_ = 0;  ///< of all these solves, beyond the fewest each
};

}  // namespace pellicle::linear
