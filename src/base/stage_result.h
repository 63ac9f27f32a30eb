#pragma once

#include <string>

namespace pellicle {
inline namespace base {

/// The outcome of a stage's work. Divergence is a result, not an error: the step control decides what follows.
struct StageResult {
  bool converged = true;
  int iterations = 0;  ///< linear iterations, all solves of the stage added
  double error = 0;    ///< the stage's own measure, such as ||C||
  std::string reason;  ///< in words, when it did not converge
};

}  // namespace base
}  // namespace pellicle
