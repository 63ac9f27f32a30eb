#include "world/fire_remarks.h"

#include <fmt/format.h>

#include <algorithm>

#include "combustion/combustion.h"
#include "io/console.h"

namespace pellicle::world {

namespace {

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

void FireRecord::note(double time, double left, double burnt_mass, double temperature_max) {
  const double fraction = left + burnt_mass > 0 ? burnt_mass / (left + burnt_mass) : 0;
  if (fraction > burnt) {
    last_time = time;
  }
  burnt = fraction;
  present_time = time;
  hottest = std::max(hottest, temperature_max);
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

std::vector<std::string> fire_remarks(const Options& options, const FireRecord& record) {
  if (record.last_time < 0 && options.combustion.mass_loss_rate > 0 &&
      is_heated_beyond(options.heat.initial_temperature, options)) {
    return {fmt::format(
        "fire: nothing has caught fire; the hottest was {:.4g} K, combustion.ignition_temperature is {:.4g} K",
        record.hottest, options.combustion.ignition_temperature)};
  }
  if (record.last_time >= 0 && record.last_time < record.present_time) {
    return {fmt::format("fire: it went out at {}, when {:.3g} % of the mass had burnt", time_text(record.last_time),
                        100 * record.burnt)};
  }
  return {};
}

}  // namespace pellicle::world
