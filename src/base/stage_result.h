#pragma once

#include <string>

#include "base/namespaces.h"

namespace pellicle::base {

/// Result of a stage. Divergence is a result, not an error: the step control decides on it.
struct StageResult {
  bool converged = true;
  int iterations = 0;  ///< linear iterations, all solves of the stage added
  double error = 0;    ///< the stage's own measure, such as ||C||
  std::string reason;  ///< message if it did not converge

  /// Takes the outcome of a further solve, and adds its iterations. @returns whether it has converged
  bool add(const StageResult& solved) {
    iterations += solved.iterations;
    converged = solved.converged;
    reason = solved.reason;
    return converged;
  }
};

}  // namespace pellicle::base
