#include "world/fire_stages.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "ablation/cut_surface.h"
#include "base/units.h"
#include "combustion/combustion.h"
#include "contact/body_heat.h"
#include "contact/contact_surface.h"
#include "heat/heat_balance.h"
#include "io/console.h"
#include "parallel/collective.h"

namespace pellicle::world {

namespace {

constexpr double heat_balance_tolerance = 1e-9;  ///< fraction of the heat that came in
constexpr double heat_balance_rounding = 1e-14;  ///< fraction of the heat that was there at first

/// Mass over initial mass of each local particle, of a sheet together with the fractions of its cells that belong to
/// the other layer: for a corner an eighth from the lattice particles of its cells, for a lattice particle an eighth
/// from each corner of its cell. Removed particles do not count. Collective.
std::vector<double> mass_ratios(const Surface& surface, const Field& mass) {
  Field sum(surface.particles, 2);  // of masses, and of initial masses
  const auto add = [&](PetscInt to, PetscInt from, double initial) {
    const double m = mass.data()[from];
    if (m > 0) {
      sum.values().col(to) += initial * Eigen::Vector2d(m / surface.initial_mass[from], 1);
    }
  };
  for (PetscInt i = 0; i < surface.particles.owned; ++i) {
    add(i, i, surface.initial_mass[i]);
  }
  for (PetscInt cell = 0; cell < surface.elements.owned && surface.has_quads(); ++cell) {
    const PetscInt lattice = surface.lattice[cell];
    const double eighth = surface.initial_mass[lattice] / 4;
    for (const PetscInt corner : surface.cells[cell]) {
      add(corner, lattice, eighth);
      add(lattice, corner, eighth);
    }
  }
  sum.add_ghosts();
  sum.update_ghosts();
  std::vector<double> ratio;
  for (PetscInt i = 0; i < surface.particles.local(); ++i) {
    const auto of_particle = sum.values().col(i);
    ratio.push_back(of_particle[1] > 0 ? of_particle[0] / of_particle[1] : 0);
  }
  return ratio;
}

/// Whether a source or a body hotter than `temperature` heats something that does not burn from the start.
bool is_heated_beyond(double temperature, const Options& options) {
  const bool by_source =
      std::any_of(options.heat.sources.begin(), options.heat.sources.end(),
                  [temperature](const auto& source) { return source.second.temperature > temperature; });
  const bool by_body = std::any_of(options.bodies.begin(), options.bodies.end(), [temperature](const auto& body) {
    return body.second.temperature.value_or(0) > temperature;
  });
  return options.heat.initial_temperature <= options.combustion.ignition_temperature && (by_source || by_body);
}

}  // namespace

HeatStage::HeatStage(const Surface& surface, const Options& options, State& state, StageClock& clock,
                     Textures& textures)
    : FireStage(surface, options, state, clock),
      conduction_(surface, options.heat,
                  textures.values(surface.uv, "heat.diffusivity_texture", options.heat.diffusivity_texture,
                                  options.heat.diffusivity_range)),
      rise_(surface.particles, 1) {
  for (const auto& [name, source] : options.heat.sources) {
    validate(name, source);
    source_texture_[name] = textures.values(surface.uv, "heat.sources." + name + ".file", source.file);
  }
  if (exchange_heat(options.bodies)) {
    bodies_ = make_bodies(surface.comm(), options.bodies);
    resting_gap_ = balances_bodies(options) ? contact_thickness(surface, options.contact) : 0;
  }
}

void HeatStage::start() {
  fields_.temperature.values().setConstant(options_.heat.initial_temperature);
  fields_.heat_initial = heat_content(surface_, fields_.mass, fields_.temperature, options_.heat.capacity);
}

StageResult HeatStage::begin(Step& step) {
  const auto timer = clock_.time("heat");
  const HeatOptions& heat = options_.heat;
  const double h = step.h;
  // Eq. 1: T^ext from the sources, then the heat released by the burning of the last step.
  for (const auto& [name, source] : heat.sources) {
    fields_.heat_in += apply_heat_source(
        fields_.temperature, source,
        {surface_, state_.position, fields_.mass, source_texture_.at(name), state_.time, h, heat.capacity});
  }
  fields_.heat_in += release_burning_heat(fields_.temperature, surface_, fields_.mass_change, fields_.mass, heat);
  const HeatExchange exchange =
      exchange_with_surroundings(fields_.temperature, surface_, state_.position, fields_.mass, fields_.active, h, heat);
  fields_.heat_in += exchange.gained;
  fields_.heat_out += exchange.lost;
  if (!bodies_.empty()) {
    const BodyHeat of_bodies = exchange_with_bodies(
        fields_.temperature, surface_, bodies_,
        {state_.position, fields_.mass, fields_.active, state_.time, h, heat.capacity, resting_gap_});
    fields_.heat_in += of_bodies.gained;
    fields_.heat_out += of_bodies.lost;
  }
  rise_.values() = -fields_.temperature.values();
  StageResult result = conduction_.advance(fields_.temperature, {state_.position, fields_.mass, fields_.active, h});
  rise_.values() += fields_.temperature.values();
  fields_.heat_made += heat_content(surface_, fields_.mass, rise_, heat.capacity);
  step.heat_iterations = result.iterations;
  return result;
}

void HeatStage::report(Report& report, const Step& step) const {
  report.add("heat_iterations", "", step.heat_iterations);
}

std::vector<std::string> HeatStage::first_remarks() const { return front_remarks(options_, mean_side(surface_)); }

CombustionStage::CombustionStage(const Surface& surface, const Options& options, State& state, StageClock& clock,
                                 Textures& textures)
    : FireStage(surface, options, state, clock),
      mass_loss_factor_(textures.values(surface.uv, "combustion.mass_loss_texture",
                                        options.combustion.mass_loss_texture, options.combustion.mass_loss_range)) {}

StageResult CombustionStage::begin(Step& step) {
  const auto timer = clock_.time("combustion");
  // A particle without active triangles neither cools nor burns.
  const std::vector<bool>& triangles = fields_.active.triangles;
  const bool is_whole = std::find(triangles.begin(), triangles.end(), false) == triangles.end();
  std::vector<bool> has_surface;
  if (on_any_rank(surface_.comm(), !is_whole)) {
    has_surface = particles_with_surface(surface_, fields_.active);
  }
  const BurnInput input{fields_.temperature, mass_loss_factor_, step.h, has_surface.empty() ? nullptr : &has_surface};
  fields_.mass_burnt += burn(fields_.mass, fields_.mass_change, surface_, input, options_.combustion);
  fields_.heat_out -= heat_content(surface_, fields_.mass_change, fields_.temperature, options_.heat.capacity);
  return {};
}

void AblationStage::start() { fields_.pieces = initial_pieces(surface_); }

StageResult AblationStage::begin(Step& step) {
  const auto timer = clock_.time("ablation");
  const double time = state_.time + step.h;
  level_ = level_set(surface_, fields_.mass, options_.ablation.loss_mass, std::move(level_));
  const auto has_burnt = [this](PetscInt particle) { return level_[particle] < 0; };
  for (std::size_t t = 0; t < surface_.triangles.size(); ++t) {
    const auto& [a, b, c] = surface_.triangles[t];
    double& burn_time = fields_.burn_time[surface_.element_of_triangle(t)];
    if (burn_time < 0 && (has_burnt(a) || has_burnt(b) || has_burnt(c))) {
      burn_time = time;
    }
  }
  step.has_burnt = burn_away(surface_, options_.ablation.spring_rule, fields_.active, level_);
  if (step.has_burnt) {
    remove_bare_particles(time);
  }
  return {};
}

/// Removes the particles that have lost their last spring; pieces separate.
void AblationStage::remove_bare_particles(double time) {
  for (const PetscInt i : bare_particles(surface_, fields_.active, fields_.mass)) {
    double& mass = fields_.mass.data()[i];
    fields_.mass_burnt += mass;
    fields_.heat_out += mass * options_.heat.capacity * fields_.temperature.data()[i];
    mass = 0;
    fields_.mass_change.data()[i] = 0;
  }
  fields_.mass.update_ghosts();
  fields_.mass_change.update_ghosts();
  update_pieces(fields_.pieces, surface_, fields_.active, time);
}

void AblationStage::draw(Picture& picture) const {
  picture.cut(cut_surface(surface_, fields_.active, level_set(surface_, fields_.mass, options_.ablation.loss_mass)));
  picture.add_on_particles("mass_ratio", mass_ratios(surface_, fields_.mass), surface_.has_quads());
  const Pieces& pieces = fields_.pieces;
  const std::vector<double> masses = piece_masses(pieces, surface_, fields_.mass);
  const auto per_element = static_cast<std::size_t>(surface_.triangles_per_element);
  std::vector<double> id;
  std::vector<double> mass;
  std::vector<double> birth_time;
  for (std::size_t t = 0; t < surface_.triangles.size(); t += per_element) {
    const PetscInt piece = pieces.of_particle[surface_.triangles[t].back()];
    id.push_back(static_cast<double>(piece));
    mass.push_back(piece >= 0 ? masses[pieces.place_of(piece)] : 0);
    birth_time.push_back(piece >= 0 ? pieces.birth_time[pieces.place_of(piece)] : 0);
  }
  picture.add_on_cells("piece", std::move(id));
  picture.add_on_cells("piece_mass", std::move(mass));
  picture.add_on_cells("piece_birth_time", std::move(birth_time));
}

CrackStage::CrackStage(const Surface& surface, const Options& options, State& state, StageClock& clock,
                       Textures& textures, MotionStage& motion)
    : FireStage(surface, options, state, clock),
      cracks_(surface, cracks_of(options),
              textures.values(surface.uv, "ablation.strength_texture", options.ablation.strength_texture,
                              options.ablation.strength_range)),
      motion_(motion) {}

StageResult CrackStage::end(Step& step) {
  const auto timer = clock_.time("ablation");
  const std::vector<PetscInt> sides = cracks_.sides({fields_.active, motion_.stress(), state_.position, fields_.mass,
                                                     motion_.pinned(), options_.combustion.min_mass});
  for (const PetscInt side : sides) {
    ++fields_.cracked_sides;
    fields_.crack_length += surface_.of(Colour::blue).initial_length[side];
  }
  step.has_cracked = crack(surface_, options_.ablation.spring_rule, fields_.active, sides);
  return {};
}

std::array<double, 2> CrackStage::sums() const {
  return sum_over_ranks(surface_.comm(), std::array{fields_.cracked_sides, fields_.crack_length});
}

void CrackStage::report(Report& report, const Step& /*step*/) const {
  const auto [sides, length] = sums();
  report.add("cracked_sides", "", sides);
  report.add("crack_length", "m", length);
}

std::vector<std::string> CrackStage::first_remarks() const {
  const std::string words = cracks_.remark();
  return words.empty() ? std::vector<std::string>() : std::vector<std::string>{words};
}

std::vector<std::string> CrackStage::remarks() const {
  const auto [sides, length] = sums();
  return sides > 0 ? std::vector<std::string>{fmt::format("cracks: {:.0f} sides of cells, {:.4g} m", sides, length)}
                   : std::vector<std::string>();
}

void note_fire(Eigen::VectorXd& record, double time, double left, double burnt, double temperature_max) {
  const double fraction = left + burnt > 0 ? burnt / (left + burnt) : 0;
  if (fraction > of(record, FireRecord::burnt)) {
    of(record, FireRecord::last_time) = time;
  }
  of(record, FireRecord::burnt) = fraction;
  of(record, FireRecord::present_time) = time;
  of(record, FireRecord::hottest) = std::max(of(record, FireRecord::hottest), temperature_max);
}

std::vector<std::string> front_remarks(const Options& options, double mean_side) {
  constexpr double least_heat = 1.3;  // over that of ignition: with less fronts have died (docs/fire.md)
  const FrontInput input{options.heat.diffusivity, options.heat.burning_heat, options.heat.initial_temperature,
                         options.ablation.loss_mass};
  const std::optional<FireFront> front = fire_front(input, options.combustion);
  if (!is_heated_beyond(options.combustion.ignition_temperature, options) || !front || front->heat < least_heat) {
    return {};
  }
  constexpr double least_cells = 2;
  const double cells = front->width / mean_side;
  std::string line =
      fmt::format("fire: without losses of heat a front goes at about {:.2g} m/s and is {:.2g} m wide, {:.2g} cells",
                  front->speed, front->width, cells);
  if (cells < least_cells) {
    line += fmt::format(
        "; on so few it goes by the mesh, and may die: expected 2 at least, sides of {:.2g} m here, or a larger "
        "heat.diffusivity or a smaller combustion.mass_loss_rate",
        front->width / least_cells);
  }
  return {line};
}

std::vector<std::string> fire_remarks(const Options& options, const Eigen::VectorXd& record) {
  const double last_time = of(record, FireRecord::last_time);
  if (last_time < 0 && options.combustion.mass_loss_rate > 0 &&
      is_heated_beyond(options.heat.initial_temperature, options)) {
    return {fmt::format(
        "fire: nothing has caught fire; the hottest was {:.4g} K, combustion.ignition_temperature is {:.4g} K",
        of(record, FireRecord::hottest), options.combustion.ignition_temperature)};
  }
  if (last_time >= 0 && last_time < of(record, FireRecord::present_time)) {
    return {fmt::format("fire: it went out at {}, when {:.3g} % of the mass had burnt", time_text(last_time),
                        100 * of(record, FireRecord::burnt))};
  }
  return {};
}

/// Collective.
FireFigures HeatBalanceStage::figures() const {
  double mass = 0;
  for (PetscInt i = 0; i < surface_.particles.owned; ++i) {
    mass += fields_.mass.data()[i];
  }
  const double content = heat_content(surface_, fields_.mass, fields_.temperature, options_.heat.capacity);
  const std::array<double, 7> sums =
      sum_over_ranks(surface_.comm(), std::array{mass, fields_.mass_burnt, content, fields_.heat_in, fields_.heat_out,
                                                 fields_.heat_made, fields_.heat_initial});
  level_ = level_set(surface_, fields_.mass, options_.ablation.loss_mass, std::move(level_));
  const double hottest = largest_drawn(surface_, fields_.active, level_, fields_.temperature.data());
  return {sums[0], sums[1], sums[2], sums[3], sums[4], sums[5], sums[6], hottest};
}

StageResult HeatBalanceStage::end(Step& step) {
  step.fire = figures();
  const FireFigures& fire = *step.fire;
  note_fire(fields_.fire_record, state_.time + step.h, fire.mass_left, fire.mass_burnt, fire.temperature_max);

  // The umbrella makes heat; the consistent operator may make none.
  const double made = options_.heat.operator_name == HeatOperator::umbrella ? fire.heat_made : 0;
  const double open = std::abs(fire.heat_content - fire.heat_initial - fire.heat_in + (fire.heat_out - made));
  const double limit = heat_balance_tolerance * fire.heat_in + heat_balance_rounding * fire.heat_initial;
  StageResult result;
  if (!(open <= limit)) {  // also when it is not a number
    result.converged = false;
    result.reason = "the heat ledger does not close: " + number_text(open) +
                    " J are unaccounted for, expected at most " + number_text(limit) + " J where " +
                    number_text(fire.heat_in) + " J came in";
  }
  return result;
}

void HeatBalanceStage::report(Report& report, const Step& step) const {
  const FireFigures fire = step.fire ? *step.fire : figures();
  report.add("mass_left", "kg", fire.mass_left);
  report.add("mass_burnt", "kg", fire.mass_burnt);
  report.add("pieces", "", static_cast<double>(fields_.pieces.present.size()));
  report.add("heat_content", "J", fire.heat_content);
  report.add("heat_in", "J", fire.heat_in);
  report.add("heat_out", "J", fire.heat_out);
  report.add("heat_made", "J", fire.heat_made);
  report.add("temperature_max", "K", fire.temperature_max);
}

std::vector<std::string> HeatBalanceStage::remarks() const { return fire_remarks(options_, fields_.fire_record); }

}  // namespace pellicle::world
