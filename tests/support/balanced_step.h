#pragma once

#include "energies/newton_options.h"
#include "energies/step_objective.h"
#include "equilibrium/implicit_step.h"

namespace pellicle {

/// Steps of a sheet's part, which are brought into balance alone.
/// @tparam Part a SpringSheet or an ElasticSheet, made with the arguments
template <class Part>
class BalancedStep {
 public:
  template <class... Arguments>
  explicit BalancedStep(const NewtonOptions& options, const Arguments&... arguments)
      : part(arguments...),
        objective_({&part}, {}, options.mat_type, options.solver_prefix),
        solver_(objective_, options) {}

  /// @param positions in: to which the sheet would go without forces; out: at the end of the step
  ImplicitResult advance(Field& positions, const SheetInput& input) {
    part.begin(positions, input);
    const ImplicitResult result = solver_.advance(input.h);
    positions.values() = part.position().values();
    return result;
  }

  Part part;

 private:
  StepObjective objective_;
  ImplicitStep solver_;
};

}  // namespace pellicle
