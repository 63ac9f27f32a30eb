#include "world/burn.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "base/error.h"
#include "base/units.h"
#include "elastic/elastic_sheet.h"
#include "elastic/sheet_springs.h"
#include "equilibrium/time_scheme.h"
#include "parallel/collective.h"
#include "solvers/vertex_potential.h"
#include "surface/net_strain.h"
#include "surface/one_layer.h"
#include "surface/shell.h"
#include "world/gas_of_object.h"

namespace pellicle {
inline namespace world {

namespace {

const std::map<std::string, BodyOptions> no_bodies;

/// Mean of the values at both ends of every local spring.
std::array<std::vector<double>, 4> at_springs(const Sheet& sheet, const std::vector<double>& values) {
  std::array<std::vector<double>, 4> result;
  if (values.empty()) {
    return result;
  }
  for (const Colour colour : all_colours) {
    for (const auto& [a, b] : sheet.of(colour).ends) {
      result[static_cast<std::size_t>(colour)].push_back((values[a] + values[b]) / 2);
    }
  }
  return result;
}

/// phi = (1 - e^{-x})/x, 1 at 0: mean of e^{-t} between 0 and x.
double exact_share(double x) { return x > 0 ? -std::expm1(-x) / x : 1; }

/// Of contact, in steps of the deck's length [Pa/m]. A projected sheet bears what it is projected to, whatever its
/// mass.
double usual_stiffness_of(const Sheet& sheet, const Options& options) {
  constexpr double strain = 0.05;  // as much as a sheet may bear
  constexpr double rigid = 10;     // times its mass in a step
  if (options.dynamics == Dynamics::projection) {
    return usual_contact_stiffness(sheet, 0, rigid * options.sheet.areal_density, options.time.step);
  }
  const bool is_static = options.time.scheme == TimeScheme::statics;
  const double stiffness =
      options.dynamics == Dynamics::elastic ? stiffness_of(options.material).tensile[0] : options.spring.stiffness;
  return usual_contact_stiffness(sheet, strain * stiffness, is_static ? 0 : options.sheet.areal_density,
                                 options.time.step);
}

/// Square root of the undeformed area [m]. Collective.
double size_of(const Sheet& sheet) {
  const std::vector<double> areas = cell_areas(sheet);
  double area = 0;
  for (std::size_t cell = 0; cell < areas.size(); ++cell) {
    area += sheet.lattice[cell] < sheet.particles.owned ? areas[cell] : 0;
  }
  area = sum_over_ranks(sheet.comm(), area);
  return std::sqrt(area);
}

}  // namespace

const std::vector<std::string>& Burn::stage_names() {
  static const std::vector<std::string> names{"heat",       "combustion", "ablation",   "external force",
                                              "projection", "velocity",   "compaction", "output"};
  return names;
}

Burn::Burn(const Sheet& sheet, const Options& options, StageClock& clock)
    : Burn(sheet, options, clock, Textures(sheet.comm()), nullptr) {}

Burn::Burn(const Sheet& sheet, const Options& options, StageClock& clock, const State& state)
    : Burn(sheet, options, clock, Textures(sheet.comm()), &state) {}

Burn::Burn(const Sheet& left, Burn&& before, const State& state)
    : Burn(left, before.options_, before.clock_, std::move(before.textures_), &state) {}

Burn::Burn(const Sheet& sheet, const Options& options, StageClock& clock, Textures textures, const State* state)
    : sheet_(sheet),
      options_(options),
      clock_(clock),
      textures_(std::move(textures)),
      burning_(sheet, options, clock, textures_),
      pins_(state == nullptr ? Pins(sheet, options.pins) : Pins(sheet, options.pins, state->pin)),
      bodies_(sheet, balances_bodies(options) ? no_bodies : options.bodies, contact_thickness(sheet, options.contact)),
      chambers_(state == nullptr ? Chambers(sheet, options.gas, options.chambers)
                                 : Chambers(sheet, options.gas, options.chambers, Eigen::Vector3d::Zero(),
                                            state->chamber, state->gas)),
      gas_step_{state != nullptr && state->gas != nullptr ? state->gas : &chambers_.initial_exchange()},
      start_(sheet.particles, 3),
      start_velocity_(sheet.particles, 3),
      held_(pins_.pinned()) {
  pins_move_ = std::any_of(options.pins.begin(), options.pins.end(), [](const auto& pin) {
    return !pin.second.path.empty() || pin.second.velocity != Eigen::Vector3d::Zero();
  });
  usual_stiffness_ = usual_stiffness_of(sheet, options);
  stiffness_ = options.contact.stiffness.value_or(usual_stiffness_);
  if (balances_bodies(options) && !options.bodies.empty()) {
    body_contact_ = std::make_unique<BodyContact>(sheet, options.bodies, options.contact, usual_stiffness_);
  }
  if (options.force.air.density > 0) {
    air_.emplace(sheet, options.force.air);
  }
  size_ = options.time.tolerance > 0 ? size_of(sheet) : 0;
  if (options.dynamics == Dynamics::projection) {
    projection_ = std::make_unique<SuccessiveProjection>(
        sheet, options.project,
        at_springs(sheet, textures_.values(sheet.uv, "project.weight_texture", options.project.weight_texture)));
    if (options.contact.self) {
      masses_ =
          std::make_unique<MassPart>(sheet, pins_.pinned(), options.elastic.snes_rtol, options.time.step, pressing());
    }
  } else {
    make_springs();
    if (chambers_.count() > 0) {
      filled_.emplace(*springs_, chambers_, gas_step_, start_, options.gas.tangent);
    }
  }
  if (chambers_.count() > 0 && !filled_) {
    end_ = Field(sheet.particles, 3);
    pushed_.emplace(chambers_, gas_step_, start_, end_);
  }
  const AblationOptions& ablation = options.ablation;
  if (ablation.strength) {
    tearing_.emplace(
        sheet, ablation,
        textures_.values(sheet.uv, "ablation.strength_texture", ablation.strength_texture, ablation.strength_range));
  }
}

void Burn::make_springs() {
  if (air_) {
    drag_ = make_drag_potential(
        sheet_.particles, *air_, start_, [this] { return moving_ && !is_static() ? 1 / moving_->h : 0; },
        [this](PetscInt i) { return start_.vector(i); });
  }
  mass_ = sheet_.initial_mass;
  if (is_static()) {
    weight_ = make_vertex_potential(sheet_.particles, [this](PetscInt i, const Eigen::Vector3d& x) {
      const Eigen::Vector3d weight = mass_[i] * options_.force.gravity;
      return PointPotential{-weight.dot(x - start_.vector(i)), -weight};
    });
  }
  if (options_.dynamics == Dynamics::spring) {
    SpringOptions spring = options_.spring;
    spring.damping = is_static() ? 0 : spring.damping;
    springs_ = std::make_unique<SpringSheet>(sheet_, spring, pins_.pinned(), options_.time.step, pressing());
    return;
  }
  SheetMaterial material = options_.material;
  material.damping = is_static() ? 0 : material.damping;
  const auto factors = [&](const char* key, const std::string& file) {
    return textures_.values(sheet_.uv, key, file, material.stiffness_range);
  };
  ElasticOptions elastic = options_.elastic;
  elastic.strain_limit = options_.project.strain_limit;
  elastic.usual_h = options_.time.step;
  springs_ = std::make_unique<ElasticSheet>(sheet_, material, options_.sheet.thickness,
                                            MaterialFactors{factors("sheet.tensile_texture", material.tensile_texture),
                                                            factors("sheet.shear_texture", material.shear_texture),
                                                            factors("sheet.bending_texture", material.bending_texture)},
                                            pins_.pinned(), pins_.clamped(), elastic, pressing());
}

/// What acts on the sheet as a potential, in addition to its stiffness.
std::vector<Potential*> Burn::pressing() {
  std::vector<Potential*> potentials;
  if (body_contact_ != nullptr) {
    potentials.push_back(body_contact_.get());
  }
  for (Potential* potential : {drag_.get(), weight_.get()}) {
    if (potential != nullptr) {
      potentials.push_back(potential);
    }
  }
  return potentials;
}

State Burn::initial_state() const {
  State state(sheet_);
  state.position.values() = perturbed_positions(sheet_, options_.sheet);
  pins_.impose(state.position, 0);
  state.pin = pins_.numbers();
  state.chamber = chambers_.numbers();
  state.pressure.assign(chambers_.count(), 0.0);
  if (gas_is_joined(options_)) {
    state.add_gas(chambers_.count(), static_cast<int>(options_.gas.links.size()));
  }
  follow_start(state);
  burning_.begin(state);
  return state;
}

void Burn::follow_start(State& state) const {
  if (state.gas != nullptr) {
    *state.gas = chambers_.first_exchange(chambers_.volumes(state.position));
  }
}

void Burn::follow(State& state) {
  state_ = &state;
  if (state.gas != nullptr) {
    chambers_.set_numbers(state.chamber);
    gas_step_ = {state.gas};
  }
  if (chambers_.count() > 0) {
    chambers_.set_living(state.living);
  }
  burning_.follow(state);
  set_lengths(state);
}

double Burn::elastic_energy(const State& state) {
  if (springs_ == nullptr) {
    return 0;
  }
  if (!moving_) {  // There has been no step.
    start_.values() = state.position.values();
    mass_.assign(state.mass.data(), state.mass.data() + sheet_.particles.local());
    set_volume_ratios(volume_ratio_, sheet_, state.mass, options_.combustion);
    set_stiffness_factors(state.mass);
    springs_->set_shape(sheet_input(state, options_.time.step));
  }
  return springs_->elastic_energy(state.position);
}

/// Collective. [J]
double Burn::kinetic_energy(const State& state) const {
  double sum = 0;
  for (PetscInt i = 0; i < sheet_.particles.owned; ++i) {
    sum += state.mass.data()[i] / 2 * state.velocity.vector(i).squaredNorm();
  }
  sum = sum_over_ranks(sheet_.comm(), sum);
  return sum;
}

/// Adds those of the springs of a sheet that is not elastic, as `dynamics` has left them. Collective.
/// @param sum of the owned particles [N]
void Burn::add_spring_forces(const State& state, Eigen::Matrix3Xd& sum) {
  if (!spring_force_) {
    spring_force_.emplace(sheet_.particles, 3);
  }
  Field& forces = *spring_force_;
  forces.values().setZero();
  for (const Colour colour : all_colours) {
    const SpringSet& set = sheet_.of(colour);
    const std::vector<double>& pull = force_[static_cast<std::size_t>(colour)];
    for (std::size_t s = 0; s < std::min(pull.size(), static_cast<std::size_t>(set.owned())); ++s) {
      const auto [a, b] = set.ends[s];
      const Eigen::Vector3d on_b = pull[s] * (state.position.vector(a) - state.position.vector(b)).normalized();
      forces.vector(a) -= on_b;
      forces.vector(b) += on_b;
    }
  }
  forces.add_ghosts();
  sum += forces.values().leftCols(sheet_.particles.owned);
}

/// Of the step, by the forces with which it has ended. To be called before what gas does is known (end_gas).
/// Collective.
void Burn::add_work(State& state) {
  const PetscInt owned = sheet_.particles.owned;
  const double h = moving_->h;
  const double phi = exact_share(fading_);
  Eigen::Matrix3Xd& moved = work_.moved;
  Eigen::Matrix3Xd& forces = work_.forces;
  Eigen::Matrix3Xd& all = work_.all;
  Eigen::VectorXd& works = work_.works;
  moved = (state.position.values() - start_.values()).leftCols(owned);
  all.setZero(3, owned);
  works.setZero(kinds_of_work);
  const auto add = [&](Work kind, const Eigen::Matrix3Xd& added) {
    of(works, kind) += added.cwiseProduct(moved).sum();
    all += added;
  };
  const auto mass = [&](PetscInt i) { return phi * mass_[i]; };
  const auto is_free = [&](PetscInt i) { return !held_[i]; };
  const auto by_particle = [&](const auto& force) -> const Eigen::Matrix3Xd& {
    forces.resize(3, owned);
    for (PetscInt i = 0; i < owned; ++i) {
      forces.col(i) = force(i);
    }
    return forces;
  };
  const auto of_potential = [&](const Potential& potential) -> const Eigen::Matrix3Xd& {
    forces.setZero(3, owned);
    potential.add_gradient(state.position, forces);
    forces *= -1;
    return forces;
  };
  add(Work::gravity, by_particle([&](PetscInt i) -> Eigen::Vector3d { return mass(i) * options_.force.gravity; }));
  if (fading_ > 0) {  // See move_freely.
    add(Work::damping, by_particle([&](PetscInt i) -> Eigen::Vector3d {
          const Eigen::Vector3d after = moved.col(i) / h;
          const Eigen::Vector3d before = start_velocity_.vector(i);
          const double m = is_free(i) ? mass(i) / h : 0;
          return m * (after - before - (after - std::exp(-fading_) * before) / phi);
        }));
  }
  if (air_) {
    add(Work::air, by_particle([&](PetscInt i) -> Eigen::Vector3d {
          const Eigen::Vector3d velocity = is_static() ? Eigen::Vector3d(0, 0, 0) : Eigen::Vector3d(moved.col(i) / h);
          return mass(i) > 0 ? Eigen::Vector3d(air_->push(i) - air_->resistance(i) * velocity)
                             : Eigen::Vector3d::Zero();
        }));
  }
  if (push_) {
    add(Work::pressure,
        by_particle([&](PetscInt i) -> Eigen::Vector3d { return mass_[i] / h * push_->velocity().vector(i); }));
  } else if (filled_) {
    add(Work::pressure, filled_->pressure_forces());
  }
  if (lift_.cols() > 0) {
    add(Work::pressure, lift_);
  }
  if (body_contact_ != nullptr) {
    add(Work::bodies, of_potential(*body_contact_));
  }
  const double viscous = springs_ != nullptr ? springs_->viscous_work(state.position) : 0;
  // What moves pins does the work that no other force does on the particles that they hold.
  if (pins_move_) {
    if (springs_ != nullptr) {
      for (const Potential* potential : springs_->of_shape()) {
        all += of_potential(*potential);
      }
    } else {
      add_spring_forces(state, all);
    }
    for (PetscInt i = 0; i < owned; ++i) {
      if (pins_.pinned()[i]) {
        const double inertial = is_static() ? 0 : mass(i);
        const Eigen::Vector3d inertia = inertial / h * (moved.col(i) / h - start_velocity_.vector(i));
        of(works, Work::pins) += (inertia - all.col(i)).dot(moved.col(i));
      }
    }
  }
  sum_over_ranks(sheet_.comm(), works);
  of(works, Work::damping) += viscous;
  state.work += works;
}

/// What is before the dynamics.
BurnStep Burn::begin_burning(State& state, double h) {
  state_ = &state;
  BurnStep step;
  const StageResult conducted = heat(state, h);
  step.heat_iterations = conducted.iterations;
  step.take(conducted);
  if (step.converged) {
    combustion(state, h);
    step.died = ablation(state, h);
  }
  return step;
}

StepPart* Burn::part() {
  if (filled_) {
    return &*filled_;
  }
  return springs_ != nullptr ? springs_.get() : masses_.get();
}

BurnStep Burn::begin(State& state, double h) {
  BurnStep step = begin_burning(state, h);
  if (step.converged) {
    step.take(begin_dynamics(state, h));
  }
  return step;
}

void Burn::end(State& state, const EquilibriumResult& balance, BurnStep& step) {
  const DynamicsResult moved = end_dynamics(state, balance);
  step.dynamics_iterations = moved.iterations;
  step.constraint_error = moved.error;
  step.newton_iterations = moved.newton_iterations;
  step.force_residual = moved.force_residual;
  step.contacts = moved.contacts;
  step.loads = moved.loads;
  step.step_error = moved.step_error;
  step.touching = balance.contact;
  step.take(moved);
  if (step.converged) {
    step.elastic_energy = elastic_energy(state);
    step.cracked = tear(state);
    step.take(end_step(state, moving_->h));
  }
}

std::string Burn::passed_limit() const {
  if (!options_.project.strain_limit || springs_ == nullptr) {
    return "";
  }
  const NetStrain strain = surface::net_strain(sheet_, springs_->position(), state_->target_length, state_->living);
  return strain.largest <= *options_.project.strain_limit ? "" : beyond_limit(strain, *options_.project.strain_limit);
}

/// Takes what has been brought into balance. Collective.
void Burn::take_balance(State& state, const EquilibriumResult& balance) {
  moved_.iterations += balance.linear_iterations;
  moved_.newton_iterations = balance.newton_iterations;
  moved_.force_residual = balance.over_tolerance * part()->tolerance();
  state.position.values() = part()->position().values();
  ask_bodies(state, moved_);
  for (PetscInt i = 0; i < sheet_.particles.local(); ++i) {
    if (state.mass.data()[i] == 0) {  // What has left stays exactly where it was.
      state.position.vector(i) = start_.vector(i);
    }
  }
  if (const std::optional<double> limit = options_.project.strain_limit; limit && moved_.converged) {
    const NetStrain strain = net_strain(state);
    moved_.reason = strain.largest <= *limit ? "" : beyond_limit(strain, *limit) + ": where all forces are in balance";
    moved_.converged = moved_.reason.empty();
  }
  if (filled_) {
    state.pressure = filled_->pressures();
  }
  if (tearing_ && springs_ != nullptr) {
    force_ = springs_->spring_forces(state.position);
  }
  moved_.error = constraint_errors(sheet_, state.position, state.target_length, state.living).total;
}

StageResult Burn::heat(State& state, double h) { return burning_.heat(state, state, h); }

StageResult Burn::end_step(State& state, double h) {
  const StageResult result = burning_.heat_ledger(state);
  if (result.converged) {
    state.time += h;
    ++state.step;
  }
  return result;
}

void Burn::combustion(State& state, double h) {
  burning_.combustion(state, h);
  const auto timer = clock_.time("combustion");
  set_lengths(state);
}

bool Burn::ablation(State& state, double h) {
  const bool has_died = burning_.ablation(state, state, h);
  if (has_died && options_.dynamics == Dynamics::elastic) {
    set_lengths(state);  // They follow from what is left, too.
  }
  return has_died;
}

bool Burn::tear(State& state) {
  if (!tearing_) {
    return false;
  }
  const auto timer = clock_.time("ablation");
  const TearingInput input{state.living, force_,         state.position,
                           state.mass,   pins_.pinned(), options_.combustion.min_mass};
  return burning_.crack(state, tearing_->cracks(input));
}

void Burn::set_lengths(State& state) {
  set_volume_ratios(volume_ratio_, sheet_, state.mass, options_.combustion);
  if (options_.dynamics == Dynamics::elastic) {
    set_surface_lengths(state.target_length, sheet_, state.living, volume_ratio_);
  } else {
    set_target_lengths(state.target_length, sheet_, volume_ratio_);
  }
}

/// Char is softer, linearly in the share that has burnt.
void Burn::set_stiffness_factors(const Field& mass) {
  stiffness_factor_.assign(sheet_.particles.local(), 1);
  for (std::size_t i = 0; i < stiffness_factor_.size() && options_.combustion.char_stiffness != 1; ++i) {
    stiffness_factor_[i] += (options_.combustion.char_stiffness - 1) *
                            burnt_share(mass.data()[i] / sheet_.initial_mass[i], options_.combustion);
  }
}

NetStrain Burn::net_strain(const State& state) const {
  if (options_.dynamics != Dynamics::elastic) {
    return surface::net_strain(sheet_, state.position, state.target_length, state.living);
  }
  return surface::net_strain(sheet_, state.position, state.target_length, state.living,
                             springs_->bearing_springs(state.living));
}

SheetInput Burn::sheet_input(const State& state, double h) const {
  return {{is_static() ? holding_ : mass_, held_, start_, h},
          state.target_length,
          volume_ratio_,
          stiffness_factor_,
          state.living};
}

/// What bodies may press on in the step to come. Collective.
void Burn::begin_bodies(const State& state, double h) {
  if (body_contact_ != nullptr) {
    body_contact_->set_surface(held_, &state.living.triangles);
    body_contact_->begin_step(start_, state.time + h, h);
  }
}

/// How the sheet meets bodies at the end of a step. Collective.
void Burn::ask_bodies(const State& state, DynamicsResult& result) const {
  if (body_contact_ != nullptr && result.converged) {
    result.contacts = body_contact_->contacts(state.position);
    result.reason = body_contact_->fault(state.position);
    result.converged = result.reason.empty();
  }
}

/// Of a projected sheet: contact moves it from these positions. In a shorter step it presses harder, as the projection
/// does, which moves the sheet as far as in a longer one. Collective.
void Burn::begin_masses(const State& state, const Field& positions, double h) {
  const double ratio = options_.time.step / h;
  stiffness_ = options_.contact.stiffness.value_or(ratio * ratio * usual_stiffness_);
  if (body_contact_ != nullptr) {
    body_contact_->set_stiffness(stiffness_);
  }
  begin_bodies(state, h);
  masses_->begin(positions, {mass_, held_, start_, h});
}

/// Projects the springs, and corrects what has run into bodies.
DynamicsResult Burn::hold_together(State& state, const ContactStep& contact) {
  const auto timer = clock_.time("projection");  // eq. 12
  DynamicsResult result;
  bodies_.begin_step(contact, &state.living.triangles);
  const auto correct = [&](Field& positions) { bodies_.correct_positions(positions, contact); };
  const auto finish = [&](Field& positions) { return bodies_.correct_triangles(positions, contact); };
  const ProjectionInput input{state.target_length,
                              mass_,
                              held_,
                              state.living,
                              std::cref(correct),
                              std::cref(finish),
                              tearing_ || pins_move_ ? &force_ : nullptr};
  static_cast<StageResult&>(result) = projection_->advance(state.position, input);
  if (input.pull != nullptr) {
    to_forces(force_, sheet_, input, contact.h);
  }
  result.contacts = bodies_.contacts();
  if (!bodies_.empty()) {  // They have moved what was projected.
    result.error = constraint_errors(sheet_, state.position, state.target_length, state.living).total;
  }
  return result;
}

/// Velocities at bodies, and what bodies have felt.
void Burn::leave_bodies(State& state, const ContactStep& contact, std::vector<BodyLoad>& loads) {
  if (body_contact_ != nullptr) {
    loads = body_contact_->loads(state.position);
    if (!is_static()) {
      const double before = kinetic_energy(state);
      body_contact_->rebound(state.position, start_velocity_, mass_, state.velocity, loads);
      of(state.work, Work::bodies) += kinetic_energy(state) - before;
    }
  } else if (!bodies_.empty()) {
    bodies_.correct_velocities(state.velocity, state.position, contact);
    loads = bodies_.loads(state.position, contact);
  }
}

/// To where velocities lead without springs, bodies and gas (eq. 8 and 9). Collective.
ContactStep Burn::move_freely(State& state, double h) {
  Field::Values x = state.position.values();
  Field::Values v = state.velocity.values();
  start_.values() = x;
  start_velocity_.values() = v;
  held_ = pins_.pinned();
  if (sheet_.layers == 1) {
    mass_ = corner_masses(sheet_, state.mass);
  } else {
    mass_.assign(state.mass.data(), state.mass.data() + sheet_.particles.local());
  }
  if (springs_ != nullptr) {
    set_volume_ratios(volume_ratio_, sheet_, state.mass, options_.combustion);
    set_stiffness_factors(state.mass);
  }
  {
    const auto timer = clock_.time("external force");  // eq. 8 and 9
    if (air_) {
      air_->begin_step({state.position, state.velocity, mass_, &state.living.triangles, state.time + h});
    }
    if (is_static()) {  // Each step ends at rest, and its weight is in the balance.
      fading_ = 0;
      v.setZero();
      holding_.assign(mass_.size(), springs_->holding_stiffness() * h * h);
    } else {
      fading_ = velocity_damping(options_) * h;
    }
    // The exact step of m dv/dt = F - c m v by a constant force F: v e^{-ch} + h F phi/m, phi = (1 - e^{-ch})/(c h).
    // With the mass m/phi in place of m every force of the step does so; a sheet at rest bears all of its weight.
    const double phi = exact_share(fading_);
    std::for_each(mass_.begin(), mass_.end(), [phi](double& mass) { mass /= phi; });
    v *= std::exp(-fading_);
    if (!is_static()) {
      v.colwise() += phi * h * options_.force.gravity;
    }
    for (PetscInt i = 0; i < sheet_.particles.local(); ++i) {
      if (mass_[i] == 0) {
        held_[i] = true;
        v.col(i).setZero();
      }
    }
    if (air_ && drag_ == nullptr) {
      air_->accelerate(state.velocity, mass_, h);
    }
    x += h * v;
    pins_.impose(state.position, state.time + h);
  }
  return {sheet_.particles, start_, held_, state.time + h, h, mass_, &start_velocity_};
}

/// Up to what is brought into balance. Collective.
StageResult Burn::begin_dynamics(State& state, double h) {
  state_ = &state;
  moving_.emplace(move_freely(state, h));
  if (chambers_.count() > 0) {
    chambers_.set_living(state.living);
    if (sheet_.layers == 1) {
      follow_corners(sheet_, state.position);
    }
    begin_gas(state, h);
  }
  if (pushed_) {
    push_.emplace(*pushed_, sheet_, state.position, mass_, held_, h);
    free_position_ = state.position.values();
    free_velocity_ = state.velocity.values();
  }
  unconstrained_ = state.position.values();
  moved_ = {};
  projections_ = 0;
  if (masses_ != nullptr) {
    if (waits_for_gas()) {  // It stays at its start until it has been projected, see move.
      begin_masses(state, start_, h);
    } else {
      choose_pressures();
      bool is_done = false;
      project(state, is_done);
      if (moved_.converged) {
        begin_masses(state, state.position, h);
      }
    }
  } else if (springs_ != nullptr) {
    const auto timer = clock_.time("projection");
    begin_bodies(state, h);
    springs_->begin(state.position, sheet_input(state, h));
    if (filled_) {
      filled_->begin_step(state.pressure, state.time + h, h);
    }
  }
  return moved_;
}

/// Whether a projected sheet cannot be projected before the balance of the objects that its gas is linked to.
bool Burn::waits_for_gas() const { return push_ && !push_->has_settled() && !pushed_->is_alone(); }

void Burn::choose_pressures() {
  if (push_ && !push_->has_settled()) {
    push_->choose_pressures();
  }
}

/// A sheet that contact has strained beyond its limit is projected again from where contact has moved it, as often as
/// the limit has steps.
StageResult Burn::move(bool& is_done) {
  if (springs_ != nullptr) {
    return {};
  }
  State& state = *state_;
  if (masses_ == nullptr) {
    return project(state, is_done);
  }
  if (waits_for_gas()) {
    const StageResult result = project(state, is_done);
    begin_masses(state, state.position, moving_->h);
    return result;
  }
  if (const std::optional<double> limit = options_.project.strain_limit; limit) {
    state.position.values() = masses_->position().values();
    if (net_strain(state).largest > *limit && projections_ < options_.project.strain_steps) {
      ++projections_;
      const int iterations = moved_.iterations;
      moved_ = hold_together(state, *moving_);
      begin_masses(state, state.position, moving_->h);
      is_done = false;
      StageResult result = moved_;
      moved_.iterations += iterations;
      return result;
    }
  }
  return {};
}

/// Of a projected sheet: one try, with the pressures that have been chosen.
StageResult Burn::project(State& state, bool& is_done) {
  if (push_ && push_->has_settled()) {
    is_done = true;
    return {};
  }
  const int iterations = moved_.iterations;
  if (push_) {
    state.pressure = push_->pressure();
    state.velocity.values() = free_velocity_ + push_->velocity().values();
    state.position.values() = free_position_ + moving_->h * push_->velocity().values();
    unconstrained_ = state.position.values();
  }
  moved_ = hold_together(state, *moving_);
  StageResult result = moved_;
  moved_.iterations += iterations;
  is_done = true;
  if (push_ && moved_.converged) {
    end_.values() = state.position.values();
    // It has no stiffness that would answer a pressure in proportion: what it is joined to takes it where it is.
    push_->settle(state.position);
    is_done = pushed_->is_alone();
  }
  return result;
}

/// From where the sheet is at the end of the step. Collective.
DynamicsResult Burn::end_dynamics(State& state, const EquilibriumResult& balance) {
  if (part() != nullptr) {
    take_balance(state, balance);
  }
  if (!moved_.converged) {
    return moved_;
  }
  add_work(state);
  if (const std::string imbalance = end_gas(state); !imbalance.empty()) {
    moved_.converged = false;
    moved_.reason = imbalance;
  }
  find_velocities(state, *moving_, moved_.loads);
  if (const std::string fault = bodies_.fault(moved_.loads); moved_.converged && !fault.empty()) {
    const std::string of_start = start_fault();
    moved_.converged = false;
    moved_.reason = of_start.empty() ? fault : of_start;
  }
  return moved_;
}

/// What the weights of gas and air do (Chambers::uneven_forces). Collective.
void Burn::lift(State& state, double h) {
  Field force(sheet_.particles, 3);
  force.values().leftCols(sheet_.particles.owned) =
      chambers_.uneven_forces(exchange_of(chambers_, state), start_, gravity_of_gas(options_), state.time);
  force.update_ghosts();
  if (sheet_.layers == 1) {
    for (std::size_t cell = 0; cell < sheet_.cells.size(); ++cell) {
      for (const PetscInt corner : sheet_.cells[cell]) {
        force.vector(corner) += force.vector(sheet_.lattice[cell]) / 4;
      }
    }
    force.update_ghosts();
  }
  lift_ = force.values().leftCols(sheet_.particles.owned);
  for (PetscInt i = 0; i < sheet_.particles.local(); ++i) {
    if (!held_[i]) {
      const Eigen::Vector3d push = h / mass_[i] * force.vector(i);
      state.velocity.vector(i) += push;
      state.position.vector(i) += h * push;
    }
  }
  if (sheet_.layers == 1) {
    follow_corners(sheet_, state.position);
  }
}

/// What is in the chambers, and may come in during the step; what its weight and its jets do. Collective.
void Burn::begin_gas(State& state, double h) {
  if (state.gas != nullptr) {
    *state.gas = chambers_.recapped(*state.gas, chambers_.volumes(start_), state.time);
    gas_step_ = {state.gas};
  }
  if (gas_pushes_unevenly(options_)) {
    lift(state, h);
  }
  if (state.gas != nullptr) {
    ChamberWalls walls = chambers_.walls(*state.gas, start_, gravity_of_gas(options_), state.time);
    gas_heat_.begin_step(chambers_, *state.gas, sheet_, start_, state, options_.heat.capacity, h, walls);
    gas_step_ = {state.gas, walls, h};
  }
  if (pushed_) {
    pushed_->gas().begin_step(state.time + h);
  }
}

/// What has come in. Collective. @returns which ledger does not close; empty: all do
std::string Burn::end_gas(State& state) {
  if (state.gas == nullptr) {
    return "";
  }
  const Eigen::VectorXd before = state.gas->wall_heat;
  *state.gas = filled_ ? filled_->end_gas(state.position)
                       : pushed_->gas().end_step(pushed_->number(), state.position, moving_->time_end, moving_->h);
  gas_step_ = {state.gas};
  const std::string fault = gas_heat_.end_step(chambers_, state.gas->wall_heat - before, state);
  return fault.empty() ? chambers_.imbalance(*state.gas, chambers_.volumes(state.position), moving_->time_end) : fault;
}

/// From where the sheet is (eq. 13 and 15), and what bodies have felt. Collective.
void Burn::find_velocities(State& state, const ContactStep& contact, std::vector<BodyLoad>& loads) {
  const auto timer = clock_.time("velocity");
  const Field::Values x = state.position.values();
  Field::Values v = state.velocity.values();
  if (is_static()) {
    v.setZero();
    leave_bodies(state, contact, loads);
    return;
  }
  v += (x - unconstrained_) / contact.h;
  for (PetscInt i = 0; i < sheet_.particles.local(); ++i) {
    if (held_[i]) {
      v.col(i) = (x.col(i) - start_.values().col(i)) / contact.h;
    }
  }
  if (options_.time.tolerance > 0) {
    moved_.step_error = step_error(state, contact.h);
  }
  leave_bodies(state, contact, loads);
  if (sheet_.layers == 1) {
    follow_corners(sheet_, state.position);
    follow_corners(sheet_, state.velocity);
  }
}

/// Estimated error of the step of length h [s], as a share of the sheet's size: the largest TimeIntegrator::error, by
/// implicit Euler, of the particles that nothing holds. Collective.
double Burn::step_error(const State& state, double h) const {
  double error = 0;
  for (PetscInt i = 0; i < sheet_.particles.owned; ++i) {
    if (!held_[i] && mass_[i] > 0) {
      const Kinematics before{start_velocity_.vector(i), Eigen::Vector3d::Zero()};
      const Kinematics after{state.velocity.vector(i), Eigen::Vector3d::Zero()};
      error = std::max(error, TimeIntegrator().error(h, before, after));
    }
  }
  error = max_over_ranks(sheet_.comm(), error);
  return error / size_;
}

}  // namespace world
}  // namespace pellicle
