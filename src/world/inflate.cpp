#include "world/inflate.h"

#include <cmath>

#include "surface/membrane_geometry.h"
#include "world/textures.h"

namespace pellicle {

const std::vector<std::string>& Inflate::stage_names() {
  static const std::vector<std::string> names{"implicit step", "volume preservation", "velocity", "output"};
  return names;
}

Inflate::Inflate(const Membrane& membrane, const Options& options, StageClock& clock)
    : membrane_(membrane),
      options_(options),
      clock_(clock),
      wall_(make_wall(membrane, options.wall,
                      Textures(membrane.comm())
                          .values(membrane.element_uv, "wall.thickness_texture", options.wall.thickness_texture))),
      mass_(vertex_masses(membrane, wall_)),
      elements_(membrane, wall_),
      pins_(membrane, options.pins),
      constraints_(membrane, options.symmetry, pins_),
      chambers_(membrane, options.gas, options.chambers, constraints_.origin(), constraints_.has_planes(),
                constraints_.projectors()),
      loads_(membrane, vertex_areas(membrane), options.attachments, options.forces, options.bodies, options.contact),
      start_(membrane.particles, 3) {
  make_solvers();
}

void Inflate::make_solvers() {
  const BalloonModel model{elements_, chambers_, constraints_,           pins_,
                           loads_,    mass_,     options_.force.gravity, options_.gas.tangent};
  implicit_.reset();
  implicit_.emplace(model, options_.prism);
  if (wall_.preserve_volume) {
    volume_preservation_ =
        std::make_unique<VolumePreservation>(membrane_, wall_, constraints_.projectors(), options_.volume);
  }
}

BalloonState Inflate::initial_state() const {
  BalloonState state(membrane_, chambers_.count());
  const Eigen::Matrix3Xd noise = perturbed_positions(membrane_, options_.sheet) - membrane_.rest;
  for (Eigen::Index i = 0; i < noise.cols(); ++i) {
    state.position.vector(i) += constraints_.projectors()[static_cast<std::size_t>(i)] * noise.col(i);
  }
  pins_.impose(state.position, 0);
  elements_.update_thickness(state.position, state.thickness_ratio);
  set_pressures(state);
  return state;
}

InflateStep Inflate::advance(BalloonState& state, double h) {
  InflateStep step;
  start_.values() = state.position.values();
  {
    const auto timer = clock_.time("implicit step");
    static_cast<ImplicitResult&>(step) =
        implicit_->advance(state.position, state.pressure, {state.velocity, state.thickness_ratio, state.time, h});
    if (!step.converged) {
      return step;
    }
    elements_.update_thickness(state.position, state.thickness_ratio);
  }
  if (volume_preservation_ != nullptr) {
    const auto timer = clock_.time("volume preservation");
    const StageResult kept = volume_preservation_->advance(state.position, state.thickness_ratio);
    step.converged = kept.converged;
    step.reason = kept.reason;
    if (!kept.converged) {
      return step;
    }
  }
  const auto timer = clock_.time("velocity");
  state.time += h;
  ++state.step;
  set_pressures(state);
  const Eigen::MatrixXd velocity = (state.position.values() - start_.values()) / h;
  if (velocity.cols() > 0) {
    step.step_error =
        h / 2 * (velocity - state.velocity.values()).colwise().norm().maxCoeff() / implicit_->length_scale();
  }
  MPI_Allreduce(MPI_IN_PLACE, &step.step_error, 1, MPI_DOUBLE, MPI_MAX, membrane_.comm());
  state.velocity.values() = velocity;
  return step;
}

void Inflate::set_pressures(BalloonState& state) const {
  const Eigen::VectorXd volumes = chambers_.volumes(state.position);
  for (int chamber = 0; chamber < chambers_.count(); ++chamber) {
    state.pressure[chamber] = gas(chamber, volumes[chamber], state).pressure;
  }
}

GasState Inflate::gas(int chamber, double volume, const BalloonState& state) const {
  GasState gas = chambers_.state(chamber, volume, state.time);
  if (chambers_.prescribes_volume(chamber)) {
    gas.pressure = state.pressure[chamber];
  }
  return gas;
}

}  // namespace pellicle
