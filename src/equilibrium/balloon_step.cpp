#include "equilibrium/balloon_step.h"

namespace pellicle {
inline namespace equilibrium {

namespace {

/// Options of a step. A step in time that ends when it has converged uses the exact tangent near its end, since
/// Newton's method converges slowly without it, and changes a tangent that is not positive definite as little as
/// necessary. By arc length the whole tangent determines where the path goes.
PrismOptions options_of_step(PrismOptions options, const TimeIntegrator& integrator) {
  if (integrator.is_static()) {
    options.inertia = false;
    options.mass_damping = 0;
    options.stiffness_damping = 0;
  }
  const bool is_exact = integrator.arc_length() || (!integrator.is_static() && options.newton == NewtonEnd::converged);
  options.positive_elements = options.positive_elements && !is_exact;
  return options;
}

}  // namespace

BalloonStep::BalloonStep(const BalloonModel& model, const PrismOptions& options, const TimeIntegrator& integrator,
                         bool is_alone)
    : potential_(model, options_of_step(options, integrator), integrator) {
  if (is_alone) {
    alone_ =
        std::make_unique<Alone>(potential_, options_of_step(options, integrator), integrator.arc_length().has_value());
  }
}

void BalloonStep::end(Field& position, Eigen::VectorXd& pressure, ImplicitResult& result) {
  potential_.write_end(position);
  if (result.converged && potential_.ends_beyond() && potential_.inverted(potential_.start(), position) > 0) {
    result.converged = false;
    result.reason = "the end of the step turns elements over: it is too long";
  }
  pressure(potential_.prescribed()) = potential_.multiplier();
}

}  // namespace equilibrium
}  // namespace pellicle
