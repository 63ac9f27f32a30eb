#pragma once

#include <optional>
#include <string>

namespace pellicle {
inline namespace world {

/// The result of a step that was tried. The same on every rank.
struct StepResult {
  bool converged = true;
  std::string reason;     ///< in words, when it did not converge
  int iterations = 0;     ///< linear iterations of all stages
  std::string figures{};  ///< further text of the progress line, such as "|C| 1.2e-05 m"
  std::optional<double>
      step_error{};  ///< estimated error of the step, a fraction of the object's size; none: no estimate
  int newton_iterations = 0;
};

}  // namespace world
}  // namespace pellicle
