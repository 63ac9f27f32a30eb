#include "world/fire_remarks.h"

#include <algorithm>
#include <cstdio>

#include "combustion/fire_front.h"
#include "io/console.h"

namespace pellicle {
inline namespace world {

namespace {

/// Whether something of a sheet or balloon that does not burn from the start can ignite.
bool is_lit(const Options& options) {
  const double ignition = options.combustion.ignition_temperature;
  const bool by_source = std::any_of(options.heat.sources.begin(), options.heat.sources.end(),
                                     [ignition](const auto& source) { return source.second.temperature > ignition; });
  const bool by_body = std::any_of(options.bodies.begin(), options.bodies.end(), [ignition](const auto& body) {
    return body.second.temperature.value_or(0) > ignition;
  });
  return options.heat.initial_temperature <= ignition && (by_source || by_body);
}

}  // namespace

void FireRecord::note(double time, double left, double burnt_mass, double temperature_max) {
  const double share = left + burnt_mass > 0 ? burnt_mass / (left + burnt_mass) : 0;
  if (share > burnt) {
    last_time = time;
  }
  burnt = share;
  present_time = time;
  hottest = std::max(hottest, temperature_max);
}

std::vector<std::string> front_remarks(const Options& options, double mean_side) {
  const std::optional<FireFront> front = fire_front({options.heat.diffusivity, options.heat.burning_heat,
                                                     options.heat.initial_temperature, options.ablation.loss_mass},
                                                    options.combustion);
  if (!is_lit(options) || !front) {
    return {};
  }
  constexpr double least_cells = 2;
  const double cells = front->width / mean_side;
  char text[400];
  std::snprintf(text, sizeof text,
                "fire: without losses of heat a front goes at about %.2g m/s and is %.2g m wide, %.2g cells",
                front->speed, front->width, cells);
  std::string line = text;
  if (cells < least_cells) {
    std::snprintf(
        text, sizeof text,
        "; on so few it goes by the mesh, and may die: expected 2 at least, sides of %.2g m here, or a larger "
        "heat.diffusivity or a smaller combustion.mass_loss_rate",
        front->width / least_cells);
    line += text;
  }
  return {line};
}

std::vector<std::string> fire_remarks(const Options& options, const FireRecord& record) {
  char text[200];
  if (record.last_time < 0 && is_lit(options)) {
    std::snprintf(text, sizeof text,
                  "fire: nothing has caught fire; the hottest was %.4g K, combustion.ignition_temperature is %.4g K",
                  record.hottest, options.combustion.ignition_temperature);
    return {text};
  }
  if (record.last_time >= 0 && record.last_time < record.present_time) {
    std::snprintf(text, sizeof text, "fire: it went out at %s, when %.3g %% of the mass had burnt",
                  time_text(record.last_time).c_str(), 100 * record.burnt);
    return {text};
  }
  return {};
}

}  // namespace world
}  // namespace pellicle
