#pragma once

#include <petscksp.h>

namespace pellicle {
inline namespace linear {

/// Decides when a preconditioner is renewed while its matrix changes: when the iterations of its solves beyond those of
/// the shortest solve have cost as much as a new one.
class PreconditionerLag {
 public:
  /// Whether a new preconditioner is due: there is none yet, the last solve failed, or solves have become slow. To be
  /// called once after each solve.
  bool due(KSP solver);

  /// Notes that the preconditioner has been renewed.
  void renewed();

  /// Notes that the present preconditioner has become useless.
  void forget() { has_one_ = false; }

 private:
  bool has_one_ = false;
  PetscInt fewest_iterations_ = 0;  ///< of a solve with the present preconditioner
  PetscInt wasted_iterations_ = 0;  ///< of all these solves, beyond the fewest each
};

}  // namespace linear
}  // namespace pellicle
