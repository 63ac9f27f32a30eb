#include "world/burn.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/error.h"
#include "base/units.h"
#include "heat/heat_balance.h"
#include "heat/heat_source.h"
#include "surface/shell.h"

namespace pellicle {

namespace {

constexpr double heat_ledger_tolerance = 1e-9;  ///< share of the heat that came in
constexpr double heat_ledger_rounding = 1e-14;  ///< share of the heat that was there at first

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
  static const std::vector<std::string> names{"heat",       "combustion", "ablation",   "external force",
                                              "projection", "velocity",   "compaction", "output"};
  return names;
}

Burn::Burn(const Sheet& sheet, const Options& options, StageClock& clock)
    : Burn(sheet, options, clock, Pins(sheet, options.pins), Textures(sheet.comm())) {}

Burn::Burn(const Sheet& sheet, const Options& options, StageClock& clock, const std::vector<PetscInt>& pin_numbers)
    : Burn(sheet, options, clock, Pins(sheet, options.pins, pin_numbers), Textures(sheet.comm())) {}

Burn::Burn(const Sheet& compacted, Burn&& before, const std::vector<PetscInt>& pin_numbers)
    : Burn(compacted, before.options_, before.clock_, Pins(compacted, before.options_.pins, pin_numbers),
           std::move(before.textures_)) {}

Burn::Burn(const Sheet& sheet, const Options& options, StageClock& clock, Pins pins, Textures textures)
    : sheet_(sheet),
      options_(options),
      clock_(clock),
      textures_(std::move(textures)),
      pins_(std::move(pins)),
      bodies_(options.bodies),
      ablation_(sheet),
      start_(sheet.particles, 3) {
  const CombustionOptions& combustion = options.combustion;
  const HeatOptions& heat = options.heat;
  mass_loss_factor_ = sample("combustion.mass_loss_texture", combustion.mass_loss_texture,
                             combustion.mass_loss_range[0], combustion.mass_loss_range[1]);
  for (const auto& [name, source] : heat.sources) {
    validate(name, source);
    source_texture_[name] = sample("heat.sources." + name + ".file", source.file, 0, 1);
  }
  conduction_ = std::make_unique<Conduction>(sheet, heat,
                                             sample("heat.diffusivity_texture", heat.diffusivity_texture,
                                                    heat.diffusivity_range[0], heat.diffusivity_range[1]));
  projection_ = std::make_unique<SuccessiveProjection>(
      sheet, options.project,
      at_springs(sheet, sample("project.weight_texture", options.project.weight_texture, 0, 1)));
  if (options.dynamics == Dynamics::spring) {
    springs_ = std::make_unique<SpringBaseline>(sheet, options.spring);
  }
  const AblationOptions& ablation = options.ablation;
  if (ablation.strength) {
    if (springs_ != nullptr) {
      throw Error("ablation.strength: tension follows from the projection, expected dynamics projection, not spring");
    }
    tearing_.emplace(sheet, ablation,
                     sample("ablation.strength_texture", ablation.strength_texture, ablation.strength_range[0],
                            ablation.strength_range[1]));
  }
}

std::vector<double> Burn::sample(const std::string& key, const std::string& file, double black, double white) {
  std::vector<double> values = textures_.values(sheet_.uv, key, file);
  for (double& value : values) {
    value = black + (white - black) * value;
  }
  return values;
}

State Burn::initial_state() const {
  State state(sheet_);
  state.position.values() = perturbed_positions(sheet_, options_.sheet);
  pins_.impose(state.position, 0);
  state.pieces = initial_pieces(sheet_);
  state.pin = pins_.numbers();
  state.temperature.values().setConstant(options_.heat.initial_temperature);
  state.heat_initial = heat_content(sheet_, state.mass, state.temperature, options_.heat.capacity);
  return state;
}

void Burn::follow(State& state) {
  set_target_lengths(state.target_length, sheet_, state.mass, options_.combustion);
  ablation_.follow_triangles(state.living);
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
  step.died = ablation(state, h);
  const DynamicsResult moved = dynamics(state, h);
  step.dynamics_iterations = moved.iterations;
  step.constraint_error = moved.error;
  step.contacts = moved.contacts;
  if (failed(moved)) {
    return step;
  }
  step.died = tear(state, h) || step.died;
  failed(end_step(state, h));
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
  const HeatExchange exchange =
      exchange_with_surroundings(state.temperature, sheet_, state.position, state.mass, state.living, h, heat);
  state.heat_in += exchange.gained;
  state.heat_out += exchange.lost;
  Field rise(sheet_.particles, 1);
  rise.values() = -state.temperature.values();
  const StageResult result = conduction_->advance(state.temperature, {state.position, state.mass, state.living, h});
  rise.values() += state.temperature.values();
  state.heat_made += heat_content(sheet_, state.mass, rise, heat.capacity);
  return result;
}

/// Whether all heat is accounted for; what the umbrella makes is, what the consistent operator makes is not.
/// Collective.
StageResult Burn::heat_ledger(const State& state) const {
  const bool makes_heat = options_.heat.operator_name == HeatOperator::umbrella;
  const double content = heat_content(sheet_, state.mass, state.temperature, options_.heat.capacity);
  std::array<double, 4> sums{content, state.heat_initial, state.heat_in,
                             state.heat_out - (makes_heat ? state.heat_made : 0)};
  MPI_Allreduce(MPI_IN_PLACE, sums.data(), 4, MPI_DOUBLE, MPI_SUM, sheet_.comm());
  const double open = std::abs(sums[0] - sums[1] - sums[2] + sums[3]);
  const double limit = heat_ledger_tolerance * sums[2] + heat_ledger_rounding * sums[1];
  StageResult result;
  if (!(open <= limit)) {  // also when it is not a number
    result.converged = false;
    result.reason = "the heat ledger does not close: " + number_text(open) +
                    " J are unaccounted for, expected at most " + number_text(limit) + " J where " +
                    number_text(sums[2]) + " J came in";
  }
  return result;
}

StageResult Burn::end_step(State& state, double h) {
  const StageResult result = heat_ledger(state);
  if (result.converged) {
    state.time += h;
    ++state.step;
  }
  return result;
}

void Burn::combustion(State& state, double h) {
  const auto timer = clock_.time("combustion");
  state.mass_burnt +=
      burn(state.mass, state.mass_change, sheet_, {state.temperature, mass_loss_factor_, h}, options_.combustion);
  state.heat_out -= heat_content(sheet_, state.mass_change, state.temperature, options_.heat.capacity);
  set_target_lengths(state.target_length, sheet_, state.mass, options_.combustion);
}

bool Burn::ablation(State& state, double h) {
  const auto timer = clock_.time("ablation");
  const std::vector<double> level = level_set(sheet_, state.mass, options_.ablation.loss_mass);
  for (std::size_t cell = 0; cell < sheet_.cells.size(); ++cell) {
    const auto is_burnt = [&level](PetscInt particle) { return level[static_cast<std::size_t>(particle)] < 0; };
    if (state.burn_time[cell] < 0 && (is_burnt(sheet_.lattice[cell]) ||
                                      std::any_of(sheet_.cells[cell].begin(), sheet_.cells[cell].end(), is_burnt))) {
      state.burn_time[cell] = state.time + h;
    }
  }
  const bool died = ablation_.burn_away(state.living, level);
  if (died) {
    take_out(state, state.time + h);
  }
  return died;
}

bool Burn::tear(State& state, double h) {
  if (!tearing_) {
    return false;
  }
  const auto timer = clock_.time("ablation");
  const TearingInput input{
      state.living, pull_, state.position, state.mass, pins_.pinned(), h, options_.combustion.min_mass};
  if (!ablation_.tear(state.living, tearing_->torn(input))) {
    return false;
  }
  for (std::size_t triangle = 0; triangle < state.living.triangles.size(); ++triangle) {
    if (!state.living.triangles[triangle] && state.burn_time[triangle / 4] < 0) {
      state.burn_time[triangle / 4] = state.time + h;
    }
  }
  take_out(state, state.time + h);
  return true;
}

/// What follows when triangles have died: particles without springs leave, pieces separate.
void Burn::take_out(State& state, double time) {
  for (const PetscInt i : ablation_.bare_particles(state.living, state.mass)) {
    double& mass = state.mass.data()[i];
    state.mass_burnt += mass;
    state.heat_out += mass * options_.heat.capacity * state.temperature.data()[i];
    mass = 0;
    state.mass_change.data()[i] = 0;
  }
  update_ghosts(sheet_.particles, state.mass, state.mass_change);
  update_pieces(state.pieces, sheet_, state.living, time);
}

DynamicsResult Burn::dynamics(State& state, double h) {
  Field::Values x = state.position.values();
  Field::Values v = state.velocity.values();
  start_.values() = x;
  held_ = pins_.pinned();
  {
    const auto timer = clock_.time("external force");  // eq. 8 and 9
    v.colwise() += h * options_.force.gravity;
    v *= std::exp(-options_.force.damping * h);
    for (PetscInt i = 0; i < sheet_.particles.local(); ++i) {
      if (state.mass.data()[i] == 0) {
        held_[static_cast<std::size_t>(i)] = true;
        v.col(i).setZero();
      }
    }
    x += h * v;
    pins_.impose(state.position, state.time + h);
  }
  const Eigen::MatrixXd unconstrained = x;
  const ContactStep contact{sheet_.particles, start_, held_, state.time + h, h};
  const std::vector<double> mass(state.mass.data(), state.mass.data() + sheet_.particles.local());
  PetscInt contacts = 0;
  const ProjectionInput input{state.target_length,
                              mass,
                              held_,
                              state.living,
                              [&](Field& positions) { contacts = bodies_.correct_positions(positions, contact); },
                              tearing_ ? &pull_ : nullptr};
  StageResult result;
  {
    const auto timer = clock_.time("projection");  // eq. 12
    if (springs_ == nullptr) {
      result = projection_->advance(state.position, input);
    } else {
      result = springs_->advance(state.position, {state.target_length, mass, held_, state.living, start_, h});
      input.after_step(state.position);
      result.error = projection_->errors(state.position, input).total;
    }
  }
  const auto timer = clock_.time("velocity");  // eq. 13 and 15
  v += (x - unconstrained) / h;
  for (PetscInt i = 0; i < sheet_.particles.local(); ++i) {
    if (held_[static_cast<std::size_t>(i)]) {
      v.col(i) = (x.col(i) - start_.values().col(i)) / h;
    }
  }
  bodies_.correct_velocities(state.velocity, state.position, contact);
  return {result, contacts};
}

}  // namespace pellicle
