#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <numeric>
#include <optional>
#include <vector>

#include "base/error.h"
#include "base/units.h"
#include "contact/body_correction.h"
#include "elastic/mass_part.h"
#include "io/texture.h"
#include "parallel/collective.h"
#include "projection/successive_projection.h"
#include "world/sheet_motion.h"

namespace pellicle::world {

namespace {

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

/// The stiffness of contact in steps of the deck's length [Pa/m]: a projected sheet takes the shape that the projection
/// gives it, whatever its mass.
double stiffness_of_contact(const Sheet& sheet, const Options& options) {
  constexpr double rigid = 10;  // times its mass in a step
  return usual_contact_stiffness(sheet, 0, rigid * options.sheet.areal_density, options.time.step);
}

/// Refuses a threshold below which a projection would leave the sheet as it is, unless a limit of the strain bounds
/// that. Collective.
void require_threshold(const Sheet& sheet, const ProjectOptions& options) {
  constexpr double most = 0.01;
  double squares = 0;  // of the lengths
  for (const SpringSet& springs : sheet.springs) {
    const auto end = springs.initial_length.begin() + springs.owned();
    squares = std::inner_product(springs.initial_length.begin(), end, springs.initial_length.begin(), squares);
  }
  const double limit = most * std::sqrt(sum_over_ranks(sheet.comm(), squares));
  if (!options.strain_limit && options.threshold > limit) {
    throw Error("project.threshold: " + number_text(options.threshold) + " m, expected at most " + number_text(limit) +
                " m, a hundredth of the norm of all springs' lengths, or project.strain_limit");
  }
}

/// The gas in a projected sheet in a step, its own or one with that in chambers of other objects: h W g p is added to
/// the sheet's velocities before the projection, with the volume's gradient g, the inverse masses W of the particles
/// that are not constrained, and the pressure p.
///
/// The pressure is that of the law at the volume to which it would push the sheet if that had no springs, whose
/// response is known (h^2 g.W g): projected springs have no stiffness that would answer a pressure in proportion.
/// Chambers of other objects that are linked to the gas see the volume as the projection has left it. In a sheet of one
/// layer the forces on the centres of cells act on the corners of the cells.
class PressureImpulse : public GasFilled {
 public:
  /// All must outlive it. @param start positions at the beginning of a step
  PressureImpulse(const Sheet& sheet, const Chambers& chambers, const GasStep& gas_step, const Field& start);

  StepGas::Part gas_part() const override {
    return {{"", &chambers_, &gas_step_}, &start_, &end_, GasTangent::exact, 0, {}, true};
  }
  /// Begins the step of the gas. Collective. @param time at the end of the step [s] @param h its length [s]
  /// @param free positions to which velocities alone lead, ghosts up to date [m]
  /// @param mass of the local particles, of those that move [kg] @param constrained local particles that nothing moves
  void begin_step(double time, double h, const Field& free, const std::vector<double>& mass,
                  const std::vector<bool>& constrained);

  /// Finds the pressures of the gas from the present state of all objects that are linked to it. Collective.
  void choose_pressures();
  /// Velocities that the pressures add to the local particles, (3 x local) [m/s].
  const Field& velocity() const { return velocity_; }
  /// Pressure of each chamber [Pa].
  const Eigen::VectorXd& pressure() const { return pressure_; }

  /// The sheet stays at these positions for the rest of the step, whatever the pressure. Collective. @returns whether
  /// the volumes differ from those where it has settled before, or it had not
  bool fix(const Field& end);
  bool is_fixed() const { return is_fixed_; }
  /// Whether the gas is that of this sheet alone, not linked to other objects.
  bool is_alone() const { return gas_->parts() == 1; }

 private:
  const Sheet& sheet_;
  const Chambers& chambers_;
  const GasStep& gas_step_;
  const Field& start_;
  Field end_;  ///< where the sheet has come to
  bool is_fixed_ = false;
  std::vector<Field> moves_;       ///< h W g of each chamber, (3 x local) [m/(s Pa)]
  FlowingGas::Response response_;  ///< as far as known
  Eigen::VectorXd pressure_;       ///< [Pa]
  Field velocity_;
};

/// The motion of a sheet that is projected (burning paper, section 7.1): it moves by itself, out of bodies and pushed
/// by its gas. A sheet that touches itself or others is projected first, and the balance moves it as masses from there.
class ProjectedMotion : public SheetMotion {
 public:
  /// All must outlive it. Collective. @throws Error on textures, and on a threshold that would stop nothing
  ProjectedMotion(const Sheet& sheet, const Options& options, State& state, StageClock& clock, Textures& textures,
                  GasStage* gas);

  StepPart* part() override { return masses_ ? &*masses_ : nullptr; }
  GasFilled* gas() override { return impulse_ ? &*impulse_ : nullptr; }
  void choose_pressures() override {
    if (impulse_ && !impulse_->is_fixed()) {
      impulse_->choose_pressures();
    }
  }
  StageResult move(bool& is_done) override;
  std::string start_fault() const override {
    return body_contact_ != nullptr ? SheetMotion::start_fault() : bodies_.sweep().start_fault();
  }
  const std::vector<Eigen::Matrix3d>& stress() override {
    return spring_stress_->find(state_.burning->active, force_, state_.position);
  }
  const std::vector<Body>& bodies() const override {
    return body_contact_ != nullptr ? SheetMotion::bodies() : bodies_.bodies();
  }

 protected:
  StageResult begin_balance(Step& step) override;
  StageResult find_positions(Step& step) override;
  Eigen::Matrix3Xd gas_forces() override;
  void add_spring_forces(Eigen::Matrix3Xd& sum) override;
  void leave_bodies(Step& step) override;
  std::string body_fault(const Step& step) const override { return bodies_.sweep().fault(step.loads); }

 private:
  /// Whether the sheet cannot be projected before the balance of the objects that its gas is linked to.
  bool waits_for_gas() const { return impulse_ && !impulse_->is_fixed() && !impulse_->is_alone(); }
  StageResult project(bool& is_done);
  StageResult project_springs();
  void begin_masses(const Field& positions);
  ContactStep contact_step() const { return {start_, constrained_, state_.time + h_, h_, mass_, &start_velocity_}; }

  BodyCorrection bodies_;  ///< none if the forces of bodies are brought into balance
  SuccessiveProjection projection_;
  std::optional<MassPart> masses_;            ///< if the sheet touches itself or others
  std::optional<PressureImpulse> impulse_;    ///< of the gas, if the sheet has chambers
  std::array<std::vector<double>, 4> force_;  ///< of the owned springs in the last step, if anything asks for it [N]
  StageResult moved_;                         ///< of all projections of the step, with ||C|| at the end [m]
  int projections_ = 0;                       ///< so often has the sheet been projected again in the step, see move
  PetscInt contacts_ = 0;                     ///< particles of this rank that bodies hold
  Eigen::Matrix3Xd free_position_;            ///< positions without springs, bodies and gas
  Eigen::Matrix3Xd free_velocity_;            ///< velocities without them
  std::optional<Field> spring_force_;         ///< see add_spring_forces; where pins move
};

}  // namespace

PressureImpulse::PressureImpulse(const Sheet& sheet, const Chambers& chambers, const GasStep& gas_step,
                                 const Field& start)
    : sheet_(sheet),
      chambers_(chambers),
      gas_step_(gas_step),
      start_(start),
      end_(sheet.particles, 3),
      pressure_(chambers.count()),
      velocity_(sheet.particles, 3) {
  for (int chamber = 0; chamber < chambers.count(); ++chamber) {
    moves_.emplace_back(sheet.particles, 3);
  }
  gas_ = std::make_shared<StepGas>(std::vector<StepGas::Part>{gas_part()});
}

void PressureImpulse::begin_step(double time, double h, const Field& free, const std::vector<double>& mass,
                                 const std::vector<bool>& constrained) {
  time_ = time;
  h_ = h;
  is_fixed_ = false;
  gas_->begin_step(time);
  response_ = {chambers_.volumes(free), Eigen::VectorXd(chambers_.count())};
  const PetscInt owned = sheet_.particles.owned;
  for (int chamber = 0; chamber < chambers_.count(); ++chamber) {
    Field& move = moves_[chamber];
    move.values().leftCols(owned) = chambers_.volume_gradient(chamber, free);
    if (sheet_.layers == 1) {
      move.update_ghosts();
      for (std::size_t cell = 0; cell < sheet_.cells.size(); ++cell) {
        for (const PetscInt corner : sheet_.cells[cell]) {
          move.vector(corner) += move.vector(sheet_.lattice[cell]) / 4;
        }
      }
    }
    double sum = 0;
    for (PetscInt i = 0; i < owned; ++i) {
      const Eigen::Vector3d gradient = move.vector(i);
      move.vector(i) *= constrained[i] ? 0 : h / mass[i];
      sum += h * gradient.dot(move.vector(i));
    }
    move.update_ghosts();
    response_.compliance[chamber] = sum_over_ranks(sheet_.comm(), sum);
  }
  gas_->set_response(number_, response_);
}

void PressureImpulse::choose_pressures() {
  velocity_.values().setZero();
  const Eigen::VectorXd& walls = gas_->walls(number_);
  for (int chamber = 0; chamber < chambers_.count(); ++chamber) {
    const double compliance = response_.compliance[chamber];
    if (!chambers_.prescribes_volume(chamber)) {
      pressure_[chamber] = gas_->states(number_)[chamber].pressure;
    } else {
      pressure_[chamber] = compliance > 0 ? (walls[chamber] - response_.walls[chamber]) / compliance : 0;
    }
    velocity_.values() += pressure_[chamber] * moves_[chamber].values();
  }
}

bool PressureImpulse::fix(const Field& end) {
  constexpr double negligible = 1e-9;  // of a volume
  end_.values() = end.values();
  const Eigen::VectorXd walls = chambers_.volumes(end);
  const bool has_moved =
      !is_fixed_ || ((walls - response_.walls).array().abs() > negligible * walls.array().abs()).any();
  is_fixed_ = true;
  response_.walls = walls;
  response_.compliance.setZero();
  gas_->set_response(number_, response_);
  return has_moved;
}

ProjectedMotion::ProjectedMotion(const Sheet& sheet, const Options& options, State& state, StageClock& clock,
                                 Textures& textures, GasStage* gas)
    : SheetMotion(sheet, options, state, clock, gas, stiffness_of_contact(sheet, options)),
      bodies_(sheet, balances_bodies(options) ? std::map<std::string, BodyOptions>() : options.bodies,
              contact_thickness(sheet, options.contact)),
      projection_(
          sheet, options.project,
          at_springs(sheet, textures.values(sheet.uv, "project.weight_texture", options.project.weight_texture))) {
  if (state.step == 0) {
    require_threshold(sheet, options.project);
  }
  if (options.contact.self) {
    masses_.emplace(sheet, pins_.pinned(), elastic_options(options).snes_rtol, options.time.step,
                    present({body_contact_.get()}));
  }
  if (gas != nullptr) {
    impulse_.emplace(sheet, gas->chambers(), gas->step(), start_);
    gas->set_filled(*impulse_);
  }
}

StageResult ProjectedMotion::begin_balance(Step& step) {
  if (impulse_) {
    impulse_->begin_step(state_.time + step.h, step.h, state_.position, mass_, constrained_);
    free_position_ = state_.position.values();
    free_velocity_ = state_.velocity.values();
  }
  moved_ = {};
  contacts_ = 0;
  projections_ = 0;
  if (!masses_) {
    return moved_;
  }
  if (waits_for_gas()) {  // It stays at its start until it has been projected, see move.
    begin_masses(start_);
    return moved_;
  }
  choose_pressures();
  bool is_done = false;
  project(is_done);
  if (moved_.converged) {
    begin_masses(state_.position);
  }
  return moved_;
}

/// Lets contact move the sheet from these positions. In a shorter step it presses harder, as the projection does, which
/// moves the sheet as far as in a longer one. Collective.
void ProjectedMotion::begin_masses(const Field& positions) {
  const double ratio = options_.time.step / h_;
  stiffness_ = options_.contact.stiffness.value_or(ratio * ratio * usual_stiffness_);
  if (body_contact_ != nullptr) {
    body_contact_->set_stiffness(stiffness_);
  }
  begin_bodies(constrained_, end_of_loads(), h_);
  masses_->begin(positions, {mass_, start_, h_});
}

/// A sheet that contact has strained beyond its limit is projected again from where contact has moved it, as often as
/// the limit has steps.
StageResult ProjectedMotion::move(bool& is_done) {
  if (!masses_) {
    return project(is_done);
  }
  if (waits_for_gas()) {
    const StageResult result = project(is_done);
    begin_masses(state_.position);
    return result;
  }
  if (impulse_) {  // Contact has moved the sheet since it was projected.
    is_done = !impulse_->fix(masses_->position()) || impulse_->is_alone();
  }
  if (const std::optional<double> limit = options_.project.strain_limit; limit) {
    state_.position.values() = masses_->position().values();
    if (weave_strain().largest > *limit && projections_ < options_.project.strain_steps) {
      ++projections_;
      is_done = false;
      const StageResult result = project_springs();
      begin_masses(state_.position);
      return result;
    }
  }
  return {};
}

/// One try, with the pressures that have been chosen.
StageResult ProjectedMotion::project(bool& is_done) {
  is_done = true;
  if (impulse_ && impulse_->is_fixed()) {
    return {};
  }
  if (impulse_) {
    state_.pressure = impulse_->pressure();
    state_.velocity.values() = free_velocity_ + impulse_->velocity().values();
    state_.position.values() = free_position_ + h_ * impulse_->velocity().values();
    unconstrained_ = state_.position.values();
  }
  const StageResult result = project_springs();
  if (impulse_ && result.converged) {
    // It has no stiffness that would answer a pressure in proportion: what it is joined to takes it where it is.
    impulse_->fix(state_.position);
    is_done = impulse_->is_alone();
  }
  return result;
}

/// Projects the springs, and corrects what has run into bodies. @returns the result of this projection alone
StageResult ProjectedMotion::project_springs() {
  const auto timer = clock_.time("projection");  // eq. 12
  const ContactStep contact = contact_step();
  bodies_.begin_step(contact, state_.active_triangles());
  const auto correct = [&](Field& positions) { bodies_.correct_positions(positions, contact); };
  const auto finish = [&](Field& positions) { return bodies_.correct_triangles(positions, contact); };
  const ProjectionInput input{state_.target_length,
                              mass_,
                              constrained_,
                              state_.burning->active,
                              std::cref(correct),
                              std::cref(finish),
                              spring_stress_ || pins_move_ ? &force_ : nullptr};
  StageResult result = projection_.advance(state_.position, input);
  if (input.pull != nullptr) {
    to_forces(force_, sheet_, input, h_);
  }
  contacts_ = bodies_.contacts();
  if (!bodies_.empty()) {  // They have moved what was projected.
    result.error = constraint_errors(sheet_, state_.position, state_.target_length, state_.burning->active).total;
  }
  moved_.add(result);
  moved_.error = result.error;
  return result;
}

StageResult ProjectedMotion::find_positions(Step& step) {
  step.motion_iterations = moved_.iterations;
  step.contacts = contacts_;
  step.constraint_error = moved_.error;
  step.projected = projection_.monitored();
  if (!masses_) {
    return moved_;
  }
  if (impulse_) {
    impulse_->fix(masses_->position());
  }
  return take_positions(*masses_, step);
}

Eigen::Matrix3Xd ProjectedMotion::gas_forces() {
  const Eigen::Map<const Eigen::VectorXd> mass(mass_.data(), sheet_.particles.owned);
  return impulse_->velocity().values().leftCols(mass.size()) * (mass / h_).asDiagonal();
}

/// The forces with which the last projection has ended. Collective.
void ProjectedMotion::add_spring_forces(Eigen::Matrix3Xd& sum) {
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
      const Eigen::Vector3d on_b = pull[s] * (state_.position.vector(a) - state_.position.vector(b)).normalized();
      forces.vector(a) -= on_b;
      forces.vector(b) += on_b;
    }
  }
  forces.add_ghosts();
  sum += forces.values().leftCols(sheet_.particles.owned);
}

void ProjectedMotion::leave_bodies(Step& step) {
  SheetMotion::leave_bodies(step);
  if (!bodies_.empty()) {
    const ContactStep contact = contact_step();
    bodies_.correct_velocities(state_.velocity, state_.position, contact);
    step.loads = bodies_.loads(state_.position, contact);
  }
}

std::unique_ptr<SheetMotion> make_projected_motion(const Sheet& sheet, const Options& options, State& state,
                                                   StageClock& clock, Textures& textures, GasStage* gas) {
  return std::make_unique<ProjectedMotion>(sheet, options, state, clock, textures, gas);
}

}  // namespace pellicle::world
