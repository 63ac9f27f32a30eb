#include "simulation/burn.h"

#include <cmath>

#include "base/error.h"
#include "heat/heat_balance.h"
#include "heat/heat_source.h"
#include "mesh/shell.h"
#include "simulation/texture_values.h"

namespace pellicle {

namespace {

/// The texture at the uv coordinates of every local particle, scaled so that black is `black` and white is `white`;
/// empty when there is no file. Collective.
std::vector<double> sample(const Sheet& sheet, const std::string& key, const std::string& file, double black,
                           double white) {
  std::vector<double> values = texture_values(sheet.comm(), sheet.uv, key, file);
  for (double& value : values) {
    value = black + (white - black) * value;
  }
  return values;
}

/// Mean of the values at both ends of every local spring.
std::array<std::vector<double>, 4> at_springs(const Sheet& sheet, const std::vector<double>& values) {
  std::array<std::vector<double>, 4> result;
  if (values.empty()) {
    return result;
  }
  for (const Colour colour : all_colours) {
    for (const auto& [a, b] : sheet.of(colour).ends) {
      result[static_cast<std::size_t>(colour)].push_back(
          (values[static_cast<std::size_t>(a)] + values[static_cast<std::size_t>(b)]) / 2);
    }
  }
  return result;
}

}  // namespace

const std::vector<std::string>& Burn::stage_names() {
  static const std::vector<std::string> names{"heat",       "combustion", "external force",
                                              "projection", "velocity",   "output"};
  return names;
}

Burn::Burn(const Sheet& sheet, const Options& options, StageClock& clock)
    : sheet_(sheet),
      options_(options),
      clock_(clock),
      pins_(sheet, options.pins),
      bodies_(options.bodies),
      start_(sheet.particles, 3) {
  const CombustionOptions& combustion = options.combustion;
  const HeatOptions& heat = options.heat;
  mass_loss_factor_ = sample(sheet, "combustion.mass_loss_texture", combustion.mass_loss_texture,
                             combustion.mass_loss_range[0], combustion.mass_loss_range[1]);
  for (const auto& [name, source] : heat.sources) {
    validate(name, source);
    source_texture_[name] = sample(sheet, "heat.sources." + name + ".file", source.file, 0, 1);
  }
  conduction_ = std::make_unique<Conduction>(sheet, heat,
                                             sample(sheet, "heat.diffusivity_texture", heat.diffusivity_texture,
                                                    heat.diffusivity_range[0], heat.diffusivity_range[1]));
  projection_ = std::make_unique<SuccessiveProjection>(
      sheet, options.project,
      at_springs(sheet, sample(sheet, "project.weight_texture", options.project.weight_texture, 0, 1)));
  if (options.dynamics == "spring") {
    springs_ = std::make_unique<SpringBaseline>(sheet, options.spring);
  }
}

State Burn::initial_state() const {
  State state(sheet_);
  state.position.values() = perturbed_positions(sheet_, options_.sheet);
  pins_.impose(state.position, 0);
  state.temperature.values().setConstant(options_.heat.initial_temperature);
  return state;
}

BurnStep Burn::advance(State& state, double h) {
  BurnStep step;
  const auto failed = [&step](const StageResult& result) {
    step.converged = result.converged;
    step.reason = result.reason;
    return !result.converged;
  };
  const StageResult conducted = heat(state, h);
  step.heat_iterations = conducted.iterations;
  if (failed(conducted)) {
    return step;
  }
  combustion(state, h);
  const StageResult moved = dynamics(state, h, step);
  step.dynamics_iterations = moved.iterations;
  step.constraint_error = moved.error;
  if (failed(moved)) {
    return step;
  }
  state.time += h;
  ++state.step;
  return step;
}

StageResult Burn::heat(State& state, double h) {
  const auto timer = clock_.time("heat");
  const HeatOptions& heat = options_.heat;
  // Eq. 1: T^ext from the sources, then what the last step's burning released.
  for (const auto& [name, source] : heat.sources) {
    state.heat_in +=
        apply_heat_source(state.temperature, source,
                          {sheet_, state.position, state.mass, source_texture_.at(name), state.time, h, heat.capacity});
  }
  state.heat_in += release_burning_heat(state.temperature, sheet_, state.mass_change, state.mass, heat);
  state.heat_out -= lose_heat(state.temperature, sheet_, state.position, state.mass, h, heat);
  return conduction_->advance(state.temperature, {state.position, state.mass, h});
}

void Burn::combustion(State& state, double h) {
  const auto timer = clock_.time("combustion");
  state.mass_burnt +=
      burn(state.mass, state.mass_change, sheet_, {state.temperature, mass_loss_factor_, h}, options_.combustion);
  state.heat_out -= heat_content(sheet_, state.mass_change, state.temperature, options_.heat.capacity);
  set_target_lengths(state.target_length, sheet_, state.mass, options_.combustion);
}

StageResult Burn::dynamics(State& state, double h, BurnStep& step) {
  Eigen::MatrixXd& x = state.position.values();
  Eigen::MatrixXd& v = state.velocity.values();
  const std::vector<bool>& pinned = pins_.pinned();
  start_.values() = x;
  {
    const auto timer = clock_.time("external force");  // eq. 8 and 9
    v.colwise() += h * options_.force.gravity;
    v *= std::exp(-options_.force.damping * h);
    x += h * v;
    pins_.impose(state.position, state.time + h);
  }
  const Eigen::MatrixXd unconstrained = x;
  const ContactStep contact{sheet_.particles, start_, pinned, state.time + h, h};
  const std::vector<double> mass(state.mass.data(), state.mass.data() + sheet_.particles.local());
  const ProjectionInput input{state.target_length, mass, pinned,
                              [&](Field& positions) { step.contacts = bodies_.correct_positions(positions, contact); }};
  StageResult result;
  {
    const auto timer = clock_.time("projection");  // eq. 12
    if (springs_ == nullptr) {
      result = projection_->advance(state.position, input);
    } else {
      result = springs_->advance(state.position, {state.target_length, mass, pinned, start_, h});
      input.after_step(state.position);
      result.error = projection_->errors(state.position, input).total;
    }
  }
  const auto timer = clock_.time("velocity");  // eq. 13 and 15
  v += (x - unconstrained) / h;
  for (PetscInt i = 0; i < sheet_.particles.local(); ++i) {
    if (pinned[static_cast<std::size_t>(i)]) {
      v.col(i) = (x.col(i) - start_.values().col(i)) / h;
    }
  }
  bodies_.correct_velocities(state.velocity, state.position, contact);
  return result;
}

}  // namespace pellicle
