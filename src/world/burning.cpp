#include "world/burning.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/units.h"
#include "combustion/combustion.h"
#include "contact/body_contact.h"
#include "contact/body_heat.h"
#include "heat/heat_balance.h"
#include "heat/heat_source.h"
#include "parallel/collective.h"

namespace pellicle {
inline namespace world {

namespace {

constexpr double heat_ledger_tolerance = 1e-9;  ///< share of the heat that came in
constexpr double heat_ledger_rounding = 1e-14;  ///< share of the heat that was there at first

}  // namespace

Burning::Burning(const Surface& surface, const Options& options, StageClock& clock, Textures& textures)
    : surface_(surface),
      options_(options),
      clock_(clock),
      mass_loss_factor_(textures.values(surface.uv, "combustion.mass_loss_texture",
                                        options.combustion.mass_loss_texture, options.combustion.mass_loss_range)),
      conduction_(surface, options.heat,
                  textures.values(surface.uv, "heat.diffusivity_texture", options.heat.diffusivity_texture,
                                  options.heat.diffusivity_range)),
      ablation_(surface, options.ablation.spring_rule),
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

void Burning::begin(BurningFields& fields) const {
  fields.pieces = initial_pieces(surface_);
  fields.temperature.values().setConstant(options_.heat.initial_temperature);
  fields.heat_initial = heat_content(surface_, fields.mass, fields.temperature, options_.heat.capacity);
}

StageResult Burning::heat(BurningFields& fields, const ObjectState& state, double h) {
  const auto timer = clock_.time("heat");
  const HeatOptions& heat = options_.heat;
  // Eq. 1: T^ext from the sources, then the heat released by the burning of the last step.
  for (const auto& [name, source] : heat.sources) {
    fields.heat_in += apply_heat_source(
        fields.temperature, source,
        {surface_, state.position, fields.mass, source_texture_.at(name), state.time, h, heat.capacity});
  }
  fields.heat_in += release_burning_heat(fields.temperature, surface_, fields.mass_change, fields.mass, heat);
  const HeatExchange exchange =
      exchange_with_surroundings(fields.temperature, surface_, state.position, fields.mass, fields.living, h, heat);
  fields.heat_in += exchange.gained;
  fields.heat_out += exchange.lost;
  if (!bodies_.empty()) {
    const BodyHeat of_bodies =
        exchange_with_bodies(fields.temperature, surface_, bodies_,
                             {state.position, fields.mass, fields.living, state.time, h, heat.capacity, resting_gap_});
    fields.heat_in += of_bodies.gained;
    fields.heat_out += of_bodies.lost;
  }
  rise_.values() = -fields.temperature.values();
  const StageResult result = conduction_.advance(fields.temperature, {state.position, fields.mass, fields.living, h});
  rise_.values() += fields.temperature.values();
  fields.heat_made += heat_content(surface_, fields.mass, rise_, heat.capacity);
  return result;
}

StageResult Burning::heat_ledger(const BurningFields& fields) const {
  const bool makes_heat = options_.heat.operator_name == HeatOperator::umbrella;
  const double content = heat_content(surface_, fields.mass, fields.temperature, options_.heat.capacity);
  std::array<double, 4> sums{content, fields.heat_initial, fields.heat_in,
                             fields.heat_out - (makes_heat ? fields.heat_made : 0)};
  sums = sum_over_ranks(surface_.comm(), sums);
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

void Burning::combustion(BurningFields& fields, double h) {
  const auto timer = clock_.time("combustion");
  // What nothing is left of at a particle neither cools nor burns.
  const std::vector<bool>& triangles = fields.living.triangles;
  const bool is_whole = std::find(triangles.begin(), triangles.end(), false) == triangles.end();
  std::vector<bool> has_surface;
  if (on_any_rank(surface_.comm(), !is_whole)) {
    has_surface = ablation_.particles_with_surface(fields.living);
  }
  const BurnInput input{fields.temperature, mass_loss_factor_, h, has_surface.empty() ? nullptr : &has_surface};
  fields.mass_burnt += burn(fields.mass, fields.mass_change, surface_, input, options_.combustion);
  fields.heat_out -= heat_content(surface_, fields.mass_change, fields.temperature, options_.heat.capacity);
}

bool Burning::ablation(BurningFields& fields, const ObjectState& state, double h) {
  const auto timer = clock_.time("ablation");
  set_level(level_, surface_, fields.mass, options_.ablation.loss_mass);
  const auto has_burnt = [this](PetscInt particle) { return level_[particle] < 0; };
  const auto per_element = static_cast<std::size_t>(surface_.triangles_per_element);
  for (std::size_t t = 0; t < surface_.triangles.size(); ++t) {
    const auto& [a, b, c] = surface_.triangles[t];
    if (fields.burn_time[t / per_element] < 0 && (has_burnt(a) || has_burnt(b) || has_burnt(c))) {
      fields.burn_time[t / per_element] = state.time + h;
    }
  }
  const bool died = ablation_.burn_away(fields.living, level_);
  if (died) {
    take_out(fields, state.time + h);
  }
  return died;
}

bool Burning::crack(BurningFields& fields, const std::vector<PetscInt>& sides) {
  for (const PetscInt side : sides) {
    ++fields.cracked_sides;
    fields.crack_length += surface_.of(Colour::blue).initial_length[side];
  }
  return ablation_.crack(fields.living, sides);
}

/// Consequences of the death of triangles: particles without springs are removed, pieces separate.
void Burning::take_out(BurningFields& fields, double time) {
  for (const PetscInt i : ablation_.bare_particles(fields.living, fields.mass)) {
    double& mass = fields.mass.data()[i];
    fields.mass_burnt += mass;
    fields.heat_out += mass * options_.heat.capacity * fields.temperature.data()[i];
    mass = 0;
    fields.mass_change.data()[i] = 0;
  }
  update_ghosts(surface_.particles, fields.mass, fields.mass_change);
  update_pieces(fields.pieces, surface_, fields.living, time);
}

}  // namespace world
}  // namespace pellicle
