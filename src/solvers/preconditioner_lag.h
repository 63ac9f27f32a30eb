#pragma once

#include <petscksp.h>

namespace pellicle {
inline namespace solvers {

/// How long a preconditioner is kept while its matrix changes: until the iterations of later solves, beyond those of
/// the shortest solve, have cost more than a new one would have.
class PreconditionerLag {
 public:
  /// Whether a new one is due: there is none yet, the last solve failed, or it has cost enough. To be asked once after
  /// each solve.
  bool due(KSP solver);

  /// To be called when there is a new one.
  void renewed();

  /// To be called when the present one has become useless: a new one is due.
  void forget() { has_one_ = false; }

 private:
  bool has_one_ = false;
  PetscInt fewest_iterations_ = 0;  ///< of the solves with the present one
  PetscInt wasted_iterations_ = 0;  ///< of its solves beyond the fewest
};

}  // namespace solvers
}  // namespace pellicle
