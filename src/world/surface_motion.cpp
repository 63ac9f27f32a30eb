#include "world/surface_motion.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace pellicle::world {

SurfaceMotion::SurfaceMotion(const Surface& surface, const Options& options, State& state, StageClock& clock,
                             GasStage* gas, const TimeIntegrator& integrator)
    : options_(options),
      state_(state),
      clock_(clock),
      gas_(gas),
      integrator_(integrator),
      pins_(surface, options.pins, state.pin),
      start_(surface.particles, 3),
      start_velocity_(surface.particles, 3),
      surface_(surface) {
  if (options.force.air.density > 0) {
    air_.emplace(surface, options.force.air);
  }
}

void SurfaceMotion::set_part(StepPart& part, const std::vector<double>& mass, std::function<void(double)> set_time,
                             GasFilledPart::SetLoad set_load) {
  part_ = &part;
  if (gas_ != nullptr) {
    StepGas::Part own{{"", &gas_->chambers(), &gas_->step()}, &start_, nullptr, options_.gas.tangent};
    if (integrator_.is_second_order()) {
      own.write_end = [this](Field& position) { write_end(position); };
    }
    filled_.emplace(*part_, own, std::move(set_load));
    gas_->set_filled(*filled_);
    part_ = &*filled_;
  }
  if (integrator_.arc_length()) {
    const auto set_time_of_all = [this, set_time = std::move(set_time)](double time) {
      set_time(time);
      if (body_contact_ != nullptr) {
        body_contact_->set_time(time, h_);
      }
      if (filled_) {
        filled_->set_time(time);
      }
    };
    path_.emplace(*part_, set_time_of_all, pins_, mass, *integrator_.arc_length());
    part_ = &*path_;
  }
}

void SurfaceMotion::set_contact(double usual_stiffness) {
  stiffness_ = options_.contact.stiffness.value_or(usual_stiffness);
  if (balances_bodies(options_) && !options_.bodies.empty()) {
    body_contact_ = std::make_unique<BodyContact>(surface_, options_.bodies, options_.contact, usual_stiffness);
  }
}

const std::vector<Body>& SurfaceMotion::bodies() const {
  static const std::vector<Body> none;
  return body_contact_ != nullptr ? body_contact_->bodies() : none;
}

void SurfaceMotion::begin_bodies(const std::vector<bool>& held, double time, double h) {
  if (body_contact_ != nullptr) {
    body_contact_->set_surface(held, state_.active_triangles());
    body_contact_->begin_step(start_, time, h);
  }
}

void SurfaceMotion::begin_gas_and_path(double time_of_balance) {
  if (filled_) {
    filled_->begin_step(state_.pressure, time_of_balance, end_of_loads(), h_);
  }
  if (path_) {
    path_->begin_step(state_.time_of_loads(), h_, *state_.direction);
  }
}

void SurfaceMotion::write_end(Field& position) const {
  position.values() = start_.values() + (part_->position().values() - start_.values()) / integrator_.fraction();
  pins_.impose(position, end_of_loads());
}

void SurfaceMotion::end_path() {
  if (path_) {
    *state_.load_time = path_->time();
    path_->write_direction(state_.position, *state_.direction);
  }
}

void SurfaceMotion::set_drag(double fraction) {
  if (!air_) {
    return;
  }
  const double reach = fraction * h_;
  const auto begin = [&](const Field& position, const Field& velocity) {
    air_->begin_step(position, velocity, mass_, state_.active_triangles(), state_.time + reach);
  };
  if (!integrator_.is_second_order()) {
    begin(start_, start_velocity_);
    return;
  }
  Field position(surface_.particles, 3);
  Field velocity(surface_.particles, 3);
  position.values() = start_.values() + reach * start_velocity_.values();
  velocity.values() = start_velocity_.values() + reach * state_.acceleration->values();
  begin(position, velocity);
}

Kinematics SurfaceMotion::start_of(PetscInt i) const {
  const Field* acceleration = state_.acceleration;
  return {start_velocity_.vector(i),
          acceleration != nullptr ? Eigen::Vector3d(acceleration->vector(i)) : Eigen::Vector3d::Zero()};
}

double SurfaceMotion::find_end(const std::vector<bool>& held) {
  double error = 0;
  for (PetscInt i = 0; i < surface_.particles.local(); ++i) {
    const Eigen::Vector3d displacement = state_.position.vector(i) - start_.vector(i);
    const Kinematics before = start_of(i);
    Kinematics after = integrator_.end(h_, displacement, before);
    if (integrator_.is_second_order() && held[i]) {
      after = {displacement / h_, Eigen::Vector3d::Zero()};
    } else {
      error = std::max(error, integrator_.error(h_, before, after));
    }
    state_.velocity.vector(i) = after.velocity;
    if (state_.acceleration != nullptr) {
      state_.acceleration->vector(i) = after.acceleration;
    }
  }
  return error;
}

void SurfaceMotion::keep_what_has_left() {
  for (PetscInt i = 0; i < surface_.particles.local(); ++i) {
    if (has_left(i) && !is_carried(i)) {
      state_.position.vector(i) = start_.vector(i);
    }
  }
}

StageResult SurfaceMotion::result_of(std::string fault) const {
  StageResult result;
  result.converged = fault.empty();
  if (!result.converged) {
    const std::string of_start = start_fault();
    result.reason = of_start.empty() ? std::move(fault) : of_start;
  }
  return result;
}

void SurfaceMotion::rebound(std::vector<BodyLoad>& loads) {
  const double before = kinetic_energy(surface_, mass(), state_.velocity);
  body_contact_->rebound(state_.position, start_velocity_, mass_, state_.velocity, loads);
  of(state_.work, Work::bodies) += kinetic_energy(surface_, mass(), state_.velocity) - before;
}

std::vector<Potential*> SurfaceMotion::present(const std::vector<Potential*>& potentials) {
  std::vector<Potential*> present;
  std::copy_if(potentials.begin(), potentials.end(), std::back_inserter(present),
               [](const Potential* potential) { return potential != nullptr; });
  return present;
}

}  // namespace pellicle::world
