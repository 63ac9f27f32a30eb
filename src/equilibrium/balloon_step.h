#pragma once

#include <memory>
#include <optional>

#include "equilibrium/implicit_step.h"
#include "equilibrium/step_potential.h"

namespace pellicle {
inline namespace equilibrium {

/// A step of a balloon by a TimeIntegrator: begun, brought into balance, by itself or together with what it touches,
/// and ended.
class BalloonStep {
 public:
  /// Collective. @param is_alone whether it is brought into balance by itself
  /// @throws Error on solver options that PETSc does not know
  BalloonStep(const BalloonModel& model, const PrismOptions& options, const TimeIntegrator& integrator = {},
              bool is_alone = true);
  BalloonStep(const BalloonStep&) = delete;  // Its solver points to its potential.
  BalloonStep& operator=(const BalloonStep&) = delete;

  /// See StepPotential::begin_step. Collective.
  void begin(const Field& position, const Eigen::VectorXd& pressure, const StepStart& start) {
    potential_.begin_step(position, pressure, start);
    h_ = start.h;
  }
  /// To be called only if it is alone. Collective.
  ImplicitResult balance() { return alone_->step.advance(h_); }
  /// Moves positions (ghosts too) and the pressures of chambers of prescribed volume to the end of the step, or, when
  /// the result has not converged, to where Newton's method gave up. Velocities, thickness, other pressures and time
  /// are left to the caller. Collective. @param result of the balance, which this may find not to be one
  void end(Field& position, Eigen::VectorXd& pressure, ImplicitResult& result);

  /// A whole step, alone. Collective.
  ImplicitResult advance(Field& position, Eigen::VectorXd& pressure, const StepStart& start) {
    begin(position, pressure, start);
    ImplicitResult result = balance();
    end(position, pressure, result);
    return result;
  }

  /// The step in progress.
  StepPotential& potential() { return potential_; }
  const StepPotential& potential() const { return potential_; }
  /// See ImplicitStep; empty if it is not alone.
  std::string solver_words() const { return alone_ ? alone_->step.solver_words() : ""; }

 private:
  struct Alone {
    Alone(StepPotential& potential, const PrismOptions& options, bool by_arc_length)
        : objective({&potential}, {}, options.mat_type, options.solver_prefix),
          step(objective, options, by_arc_length ? &potential : nullptr) {}

    StepObjective objective;
    ImplicitStep step;
  };

  StepPotential potential_;
  std::unique_ptr<Alone> alone_;
  double h_ = 0;  ///< of the step in progress [s]
};

}  // namespace equilibrium
}  // namespace pellicle
