#pragma once

#include <memory>
#include <vector>

#include "base/stage_clock.h"
#include "contact/bodies.h"
#include "contact/pins.h"
#include "heat/conduction.h"
#include "projection/spring_baseline.h"
#include "projection/successive_projection.h"
#include "simulation/options.h"
#include "simulation/state.h"

namespace pellicle {

/// What a step of the burning sheet tells the ledger.
struct BurnStep {
  bool converged = true;
  std::string reason;  ///< of a failure, in words
  int heat_iterations = 0;
  int dynamics_iterations = 0;
  double constraint_error = 0;  ///< ||C|| at the end [m]
  PetscInt contacts = 0;        ///< particles of this rank held by a body at the end
};

/// The chain of the burning paper: heat, combustion, external force, projection with contact, velocity (section 4).
class Burn {
 public:
  /// Reads textures, builds operators. Sheet, options and clock must outlive it. Collective.
  /// @throws Error on textures that cannot be read or are asked for on a sheet without texture coordinates
  Burn(const Sheet& sheet, const Options& options, StageClock& clock);

  /// The state at time 0. Collective.
  State initial_state() const;

  /// One step of length h from `state.time`; the caller restores the state when it did not converge. Collective.
  BurnStep advance(State& state, double h);

  /// The names of the stages, for the clock.
  static const std::vector<std::string>& stage_names();

  /// ||C|| of each colour in the last step, if `project.monitor` asks for it.
  const std::vector<ProjectionError>& projection_errors() const { return projection_->monitored(); }

 private:
  StageResult heat(State& state, double h);
  void combustion(State& state, double h);
  StageResult dynamics(State& state, double h, BurnStep& step);

  const Sheet& sheet_;
  const Options& options_;
  StageClock& clock_;
  std::vector<double> mass_loss_factor_;                       ///< of the local particles, or empty
  std::map<std::string, std::vector<double>> source_texture_;  ///< sampled values of the heat textures
  std::unique_ptr<Conduction> conduction_;
  Pins pins_;
  Bodies bodies_;
  std::unique_ptr<SuccessiveProjection> projection_;
  std::unique_ptr<SpringBaseline> springs_;  ///< in place of the projection, if asked for
  Field start_;                              ///< positions at the beginning of the step
};

}  // namespace pellicle
