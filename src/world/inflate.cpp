#include "world/inflate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/error.h"
#include "combustion/combustion.h"
#include "parallel/collective.h"
#include "solvers/vertex_potential.h"
#include "surface/membrane_geometry.h"
#include "world/gas_of_object.h"
#include "world/textures.h"

namespace pellicle {
inline namespace world {

namespace {

Wall wall_of(const Membrane& membrane, const Options& options, Textures& textures) {
  return make_wall(membrane, options.wall,
                   textures.values(membrane.element_uv, "wall.thickness_texture", options.wall.thickness_texture));
}

/// Of contact, with the wall's means [Pa/m]. Collective.
double usual_stiffness_of(const Membrane& membrane, const Wall& wall, const Options& options) {
  std::array<double, 3> sums{};  // of area, of mass, of 6 mu h, the tension of rubber that is drawn out far
  for (PetscInt e = 0; e < membrane.elements.owned; ++e) {
    const double area = wall.rest[e].area;
    sums[0] += area;
    sums[1] += area * wall.thickness[e] * wall.density[e];
    sums[2] += area * wall.thickness[e] * 6 * small_strain_moduli(wall.material_of(e)).shear;
  }
  sums = sum_over_ranks(membrane.comm(), sums);
  const bool is_static = options.time.scheme == TimeScheme::statics || !options.prism.inertia;
  return usual_contact_stiffness(membrane, sums[2] / sums[0], is_static ? 0 : sums[1] / sums[0], options.time.step);
}

TimeIntegrator integrator_of(const TimeOptions& time) {
  switch (time.scheme) {
    case TimeScheme::generalized_alpha:
      return TimeIntegrator::generalized_alpha(time.spectral_radius);
    case TimeScheme::statics:
      return TimeIntegrator::statics(time.arc_length);
    default:
      return time.arc_length ? TimeIntegrator::statics(time.arc_length) : TimeIntegrator();
  }
}

}  // namespace

void make_burnable(Membrane& membrane, const Options& options) {
  if (!balloon_burns(options)) {
    return;
  }
  Textures textures(membrane.comm());
  const Wall wall = wall_of(membrane, options, textures);
  std::vector<double> mass;
  for (std::size_t e = 0; e < wall.rest.size(); ++e) {
    mass.push_back(wall.density[e] * wall.rest[e].volume);
  }
  set_burnable(membrane, std::move(mass));
}

BalloonState state_at_rest(const Membrane& membrane, const Options& options, int chambers) {
  BalloonState state(membrane, chambers, balloon_burns(options));
  if (const std::size_t loads = options.attachments.size() + options.forces.size(); loads > 0) {
    state.add_loads(static_cast<int>(loads));
  }
  if (options.time.scheme == TimeScheme::generalized_alpha) {
    state.add_acceleration();
  }
  if (options.time.arc_length) {
    state.add_path();
  }
  if (gas_is_joined(options)) {
    state.add_gas(chambers, static_cast<int>(options.gas.links.size()));
  }
  return state;
}

const std::vector<std::string>& Inflate::stage_names(bool burns) {
  static const std::vector<std::string> names{"implicit step", "volume preservation", "velocity", "output"};
  static const std::vector<std::string> with_fire{"heat",          "combustion", "ablation",
                                                  "implicit step", "velocity",   "output"};
  return burns ? with_fire : names;
}

Inflate::Inflate(const Membrane& membrane, const Options& options, StageClock& clock)
    : Inflate(membrane, options, clock, Textures(membrane.comm()), nullptr) {}

Inflate::Inflate(const Membrane& membrane, const Options& options, StageClock& clock, const BalloonState& state)
    : Inflate(membrane, options, clock, Textures(membrane.comm()), &state) {}

Inflate::Inflate(const Membrane& parted, Inflate&& before, const BalloonState& state)
    : Inflate(parted, before.options_, before.clock_, std::move(before.textures_), &state) {}

Inflate::Inflate(const Membrane& membrane, const Options& options, StageClock& clock, Textures textures,
                 const BalloonState* state)
    : membrane_(membrane),
      options_(options),
      clock_(clock),
      textures_(std::move(textures)),
      wall_(wall_of(membrane, options, textures_)),
      mass_(vertex_masses(membrane, wall_)),
      elements_(membrane, wall_),
      integrator_(integrator_of(options.time)),
      pins_(state == nullptr ? Pins(membrane, options.pins) : Pins(membrane, options.pins, state->pin)),
      constraints_(membrane, options.symmetry, pins_),
      chambers_(state == nullptr ? Chambers(membrane, options.gas, options.chambers, constraints_.origin(),
                                            constraints_.planes(), constraints_.projectors())
                                 : Chambers(membrane, options.gas, options.chambers, constraints_.origin(),
                                            state->chamber, state->gas, constraints_.planes())),
      gas_step_{state != nullptr && state->gas != nullptr ? state->gas : &chambers_.initial_exchange()},
      loads_(membrane, vertex_areas(membrane), options.attachments, options.forces,
             state == nullptr ? nullptr : state->loads),
      usual_stiffness_(usual_stiffness_of(membrane, wall_, options)),
      bodies_(membrane, options.bodies, options.contact, usual_stiffness_),
      uneven_(membrane.particles, 3),
      between_(membrane.particles, 3),
      start_(membrane.particles, 3),
      start_velocity_(membrane.particles, 3) {
  if (balloon_burns(options)) {
    burning_.emplace(membrane, options, clock, textures_);
    const AblationOptions ablation = cracks_of(options);
    if (ablation.strength) {
      cracks_.emplace(membrane, ablation,
                      textures_.values(membrane.uv, "ablation.strength_texture", ablation.strength_texture,
                                       ablation.strength_range));
    }
    hold_ = make_vertex_potential(membrane.particles, [this](PetscInt i, const Eigen::Vector3d& x) {
      PointPotential hold;
      const auto vertex = static_cast<std::size_t>(i);
      if (mass_[vertex] == 0) {  // As if it had its mass and no velocity.
        const double stiffness = membrane_.initial_mass[vertex] / (h_ * h_);
        const Eigen::Vector3d away = x - start_.vector(i);
        hold = {stiffness / 2 * away.squaredNorm(), stiffness * away, stiffness * Eigen::Matrix3d::Identity()};
      }
      return hold;
    });
  }
  if (options.force.air.density > 0) {
    air_.emplace(membrane, options.force.air);
    drag_ = make_drag_potential(
        membrane.particles, *air_, start_, [this] { return step_->rate(); },
        [this](PetscInt i) { return step_->still(i); });
  }
  if (gas_pushes_unevenly(options)) {
    lift_ = make_vertex_potential(membrane.particles, [this](PetscInt i, const Eigen::Vector3d& x) {
      const Eigen::Vector3d force = uneven_.vector(i);
      return PointPotential{-force.dot(x - start_.vector(i)), -force};
    });
  }
  if (options.wall.bends()) {
    bending_.emplace(elements_, constraints_.projectors(), pins_.clamped());
  }
  // It is made for the wall as it was, whatever has happened to it.
  elements_.set_burnt({}, {});
  BalloonModel model{
      elements_,           chambers_, gas_step_, constraints_, pins_, loads_, mass_, options_.force.gravity,
      options_.gas.tangent};
  if (bending_) {
    model.others.push_back(&*bending_);
  }
  for (Potential* potential : {hold_.get(), drag_.get(), lift_.get()}) {
    if (potential != nullptr) {
      model.others.push_back(potential);
    }
  }
  if (!bodies_.empty()) {
    model.bodies = &bodies_;
  }
  step_.emplace(model, options_.prism, integrator_);
  if (wall_.preserve_volume) {
    volume_preservation_ =
        std::make_unique<VolumePreservation>(membrane_, wall_, constraints_.projectors(), options_.volume);
  }
}

std::vector<bool> Inflate::held() const {
  std::vector<bool> held(constraints_.projectors().size(), false);
  for (const PetscInt i : constraints_.projectors().bound()) {
    held[i] = true;
  }
  return held;
}

BalloonState Inflate::initial_state() const {
  BalloonState state = state_at_rest(membrane_, options_, chambers_.count());
  const Eigen::Matrix3Xd noise = perturbed_positions(membrane_, options_.sheet) - membrane_.rest;
  for (Eigen::Index i = 0; i < noise.cols(); ++i) {
    state.position.vector(i) += constraints_.projectors()[i] * noise.col(i);
  }
  pins_.impose(state.position, 0);
  state.pin = pins_.numbers();
  state.chamber = chambers_.numbers();
  if (state.loads != nullptr) {
    *state.loads = loads_.chosen();
  }
  follow_start(state);
  if (burning_) {
    burning_->begin(*state.burning);
  }
  return state;
}

void Inflate::follow_start(BalloonState& state) const {
  if (state.gas != nullptr) {
    *state.gas = chambers_.first_exchange(chambers_.volumes(state.position));
  }
  elements_.update_thickness(state.position, state.thickness_ratio);
  set_pressures(state);
}

InflateStep Inflate::begin(BalloonState& state, double h) {
  state_ = &state;
  InflateStep step;
  if (burning_) {
    const StageResult burnt = burn(state, h, step.has_burnt);
    step.heat_iterations = burnt.iterations;
    step.converged = burnt.converged;
    step.reason = burnt.reason;
    if (!step.converged) {
      return step;
    }
  }
  start_.values() = state.position.values();
  start_velocity_.values() = state.velocity.values();
  h_ = h;
  const auto timer = clock_.time("implicit step");
  if (bending_) {
    bending_->begin_step(state.position, state.thickness_ratio);
  }
  begin_contact(state);
  begin_gas(state);
  begin_acceleration(state);
  set_drag(state, integrator_.share());
  step_->begin_step(state.position, state.pressure, start_of_step(state));
  return step;
}

void Inflate::end(BalloonState& state, const EquilibriumResult& balance, InflateStep& step) {
  {
    const auto timer = clock_.time("implicit step");
    static_cast<ImplicitResult&>(step) = balance;
    step.touching = balance.contact;
    step.reason = step_->end_step(state.position, state.pressure);
    step.converged = step.reason.empty();
    if (step.converged) {
      step.reason = bodies_.fault(step_->position());
      step.converged = step.reason.empty();
      step.loads = bodies_.loads(step_->position());
    }
    if (!step.converged) {
      if (const std::string fault = start_fault(); !fault.empty()) {
        step.reason = fault;
      }
      return;
    }
    if (burning_) {  // What has left stays exactly where it was, whatever pulls at it.
      for (PetscInt i = 0; i < membrane_.particles.local(); ++i) {
        if (state.burning->mass.data()[i] == 0) {
          state.position.vector(i) = start_.vector(i);
        }
      }
    }
    elements_.update_thickness(state.position, state.thickness_ratio);
    add_work(state);
    step.reason = end_gas(state);
    step.converged = step.reason.empty();
    if (!step.converged) {
      return;
    }
  }
  if (volume_preservation_ != nullptr) {
    const auto timer = clock_.time("volume preservation");
    const StageResult preserved = volume_preservation_->advance(state.position, state.thickness_ratio);
    step.converged = preserved.converged;
    step.reason = preserved.reason;
    if (!step.converged) {
      return;
    }
  }
  {
    const auto timer = clock_.time("velocity");
    state.time += h_;
    ++state.step;
    if (integrator_.arc_length()) {
      *state.load_time = step_->time();
      step_->write_direction(state.position, *state.direction);
    }
    set_pressures(state);
    step.step_error = move_on(state) / step_->length_scale();
    step.step_error = max_over_ranks(membrane_.comm(), step.step_error);
    step.inverted = elements_.inverted(start_, state.position);
    step.inverted = sum_over_ranks(membrane_.comm(), step.inverted);
  }
  if (bodies_.rebounds() && options_.time.scheme == TimeScheme::implicit_euler) {
    const double before = kinetic_energy(state.velocity);
    bodies_.rebound(state.position, start_velocity_, mass_, state.velocity, step.loads);
    of(state.work, Work::bodies) += kinetic_energy(state.velocity) - before;
  }
  step.has_cracked = crack(state);
}

/// Of the step, by the forces with which it is in balance. Collective.
void Inflate::add_work(BalloonState& state) {
  StepPotential& step = *step_;
  const StepWork work = step.work(state.position, start_velocity_);
  std::array<double, 2> of_others{drag_ != nullptr ? step.work_of(*drag_, state.position) : 0,
                                  lift_ != nullptr ? step.work_of(*lift_, state.position) : 0};
  of_others = sum_over_ranks(membrane_.comm(), of_others);
  of(state.work, Work::gravity) += work.gravity;
  of(state.work, Work::damping) += work.damping;
  of(state.work, Work::pins) += work.pins;
  of(state.work, Work::pressure) += work.pressure + of_others[1];
  of(state.work, Work::bodies) += work.bodies;
  of(state.work, Work::air) += of_others[0];
  of(state.work, Work::loads) += work.loads;
}

/// Collective. [J]
double Inflate::kinetic_energy(const Field& velocity) const {
  double sum = 0;
  for (PetscInt i = 0; i < membrane_.particles.owned; ++i) {
    sum += mass_[i] / 2 * velocity.vector(i).squaredNorm();
  }
  sum = sum_over_ranks(membrane_.comm(), sum);
  return sum;
}

/// What is in the chambers, and may come in during the step. Collective.
void Inflate::begin_gas(BalloonState& state) {
  if (state.gas != nullptr) {
    *state.gas = chambers_.recapped(*state.gas, chambers_.volumes(state.position), state.time);
    gas_step_ = {state.gas};
  }
  if (lift_ != nullptr) {
    // As far as the forces are in balance at the beginning of the step, or on the way through it.
    between_.values() = state.position.values();
    if (integrator_.is_second_order()) {
      between_.values() += integrator_.share() * h_ * state.velocity.values();
    }
    uneven_.values().leftCols(membrane_.particles.owned) = chambers_.uneven_forces(
        exchange_of(chambers_, state), between_, gravity_of_gas(options_), state.time_of_loads());
  }
  if (state.gas == nullptr) {
    return;
  }
  ChamberWalls walls = chambers_.walls(*state.gas, state.position, gravity_of_gas(options_), state.time_of_loads());
  if (burning_) {
    gas_heat_.begin_step(chambers_, *state.gas, membrane_, state.position, *state.burning, options_.heat.capacity, h_,
                         walls);
  }
  gas_step_ = {state.gas, walls, integrator_.share() * h_};
}

/// What has come in. Collective. @returns which ledger does not close; empty: all do
std::string Inflate::end_gas(BalloonState& state) {
  if (state.gas == nullptr) {
    return "";
  }
  const Eigen::VectorXd before = state.gas->wall_heat;
  *state.gas = step_->end_gas(state.position);
  gas_step_ = {state.gas};
  if (burning_) {
    const std::string fault = gas_heat_.end_step(chambers_, state.gas->wall_heat - before, *state.burning);
    if (!fault.empty()) {
      return fault;
    }
  }
  return chambers_.imbalance(*state.gas, chambers_.volumes(state.position), state.time + h_);
}

/// What bodies may press on in the step to come.
void Inflate::begin_contact(const BalloonState& state) {
  std::vector<bool> held = pins_.pinned();
  for (std::size_t i = 0; burning_ && i < held.size(); ++i) {
    held[i] = held[i] || state.burning->mass.data()[i] == 0;
  }
  bodies_.set_surface(held, burning_ ? &state.burning->living.triangles : nullptr);
}

StepStart Inflate::start_of_step(const BalloonState& state) const {
  return {state.velocity, state.thickness_ratio, state.time_of_loads(), h_, state.acceleration, state.direction};
}

/// The accelerations from which the first step goes on, if they count. Collective.
void Inflate::begin_acceleration(BalloonState& state) {
  if (state.acceleration == nullptr || state.step > 0) {
    return;
  }
  state.acceleration->values().setZero();
  set_drag(state, 0);
  gas_step_.h = 0;
  const Eigen::Matrix3Xd acceleration = step_->acceleration(state.position, start_of_step(state));
  state.acceleration->values().leftCols(acceleration.cols()) = acceleration;
  state.acceleration->update_ghosts();
  gas_step_.h = integrator_.share() * h_;
}

/// Velocities, and accelerations if they count, from the positions before and after the step. @returns the largest
/// error of this rank's vertices [m]
double Inflate::move_on(BalloonState& state) const {
  const StepStart start = start_of_step(state);
  double error = 0;
  for (PetscInt i = 0; i < membrane_.particles.local(); ++i) {
    const Eigen::Vector3d displacement = state.position.vector(i) - start_.vector(i);
    const Kinematics before = start.motion(i);
    Kinematics after = integrator_.end(h_, displacement, before);
    if (integrator_.is_second_order() && pins_.pinned()[i]) {
      after = {displacement / h_, Eigen::Vector3d::Zero()};  // They move evenly in each step.
    }
    error = std::max(error, integrator_.error(h_, before, after));
    state.velocity.vector(i) = after.velocity;
    if (state.acceleration != nullptr) {
      state.acceleration->vector(i) = after.acceleration;
    }
  }
  return error;
}

/// Heat, combustion and ablation. Collective. @param has_burnt set to whether an element has burnt away, on any rank
StageResult Inflate::burn(BalloonState& state, double h, bool& has_burnt) {
  BurningFields& fields = *state.burning;
  StageResult result = burning_->heat(fields, state, h);
  if (!result.converged) {
    return result;
  }
  burning_->combustion(fields, h);
  has_burnt = burning_->ablation(fields, state, h);
  hold_what_has_left(state);
  take_over(state);
  const int iterations = result.iterations;
  result = burning_->heat_ledger(fields);
  result.iterations = iterations;
  return result;
}

/// The air's drag in the step to come. Collective.
/// @param share of the step at which forces are in balance
void Inflate::set_drag(const BalloonState& state, double share) {
  if (!air_) {
    return;
  }
  if (!integrator_.is_second_order()) {
    air_->begin_step(
        {state.position, state.velocity, {}, burning_ ? &state.burning->living.triangles : nullptr, state.time + h_});
    return;
  }
  Field position(membrane_.particles, 3);
  Field velocity(membrane_.particles, 3);
  position.values() = state.position.values() + share * h_ * state.velocity.values();
  velocity.values() = state.velocity.values() + share * h_ * state.acceleration->values();
  air_->begin_step({position, velocity, {}, nullptr, state.time + share * h_});
}

void Inflate::hold_what_has_left(BalloonState& state) const {
  for (PetscInt i = 0; i < membrane_.particles.local(); ++i) {
    if (state.burning->mass.data()[i] == 0) {
      state.velocity.vector(i).setZero();
    }
  }
}

/// Cracks what the step has pulled too hard, if anything can crack. Collective. @returns whether anything has, on any
/// rank
bool Inflate::crack(BalloonState& state) {
  if (!cracks_) {
    return false;
  }
  const auto timer = clock_.time("ablation");
  BurningFields& fields = *state.burning;
  std::vector<Eigen::Matrix3d> stress = elements_.tensions(state.position, state.thickness_ratio);
  for (std::size_t e = 0; e < stress.size() && options_.wall.strength; ++e) {
    stress[e] /= wall_.thickness[e] * state.thickness_ratio[e];
  }
  return burning_->crack(fields, cracks_->sides({fields.living, stress, state.position, fields.mass, pins_.pinned(),
                                                 options_.combustion.min_mass}));
}

void Inflate::follow(BalloonState& state) {
  state_ = &state;
  if (state.gas != nullptr) {
    chambers_.set_numbers(state.chamber);
    gas_step_ = {state.gas};
  }
  if (burning_) {
    burning_->follow(*state.burning);
    take_over(state);
  }
}

/// Sets mass and stiffness of the wall after burning.
void Inflate::take_over(const BalloonState& state) {
  if (!burning_) {
    return;
  }
  const BurningFields& fields = *state.burning;
  std::copy_n(fields.mass.data(), mass_.size(), mass_.begin());
  const CombustionOptions& combustion = options_.combustion;
  std::vector<double> stiffness;
  std::vector<double> length;
  for (std::size_t e = 0; e < membrane_.triangles.size(); ++e) {
    double ratio = 0;
    double temperature = 0;
    for (const PetscInt vertex : membrane_.triangles[e]) {
      const double mass = fields.mass.data()[vertex];
      ratio += (mass > 0 ? mass / membrane_.initial_mass[vertex] : combustion.min_mass) / 3;
      temperature += fields.temperature.data()[vertex] / 3;
    }
    const double char_stiffness = 1 + (combustion.char_stiffness - 1) * burnt_share(ratio, combustion);
    const std::optional<double> reference = options_.wall.reference_temperature;
    const double warmth = reference ? temperature / *reference : 1;
    stiffness.push_back(fields.living.triangles[e] ? char_stiffness * warmth : 0);
    length.push_back(volume_ratio(ratio, combustion));
  }
  elements_.set_burnt(std::move(stiffness), length);
  chambers_.set_living(fields.living);
}

void Inflate::set_pressures(BalloonState& state) const {
  const std::vector<GasState> gas =
      chambers_.states(exchange_of(chambers_, state), chambers_.volumes(state.position), state.time_of_loads());
  for (int chamber = 0; chamber < chambers_.count(); ++chamber) {
    if (!chambers_.prescribes_volume(chamber)) {
      state.pressure[chamber] = gas[chamber].pressure;
    }
  }
}

}  // namespace world
}  // namespace pellicle
