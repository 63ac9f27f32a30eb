#pragma once

#include <map>
#include <string>
#include <vector>

#include "world/balloon_state.h"
#include "world/state.h"

namespace pellicle {

/// Every member of a state as numbers, by its name. The structured bindings name all members: one that is added later
/// does not compile here before it is added here, too.
using StateValues = std::map<std::string, std::vector<double>>;

inline std::vector<double> numbers(const Field& field) { return {field.data(), field.data() + field.values().size()}; }

template <class Range>
std::vector<double> numbers(const Range& range) {
  return {range.begin(), range.end()};
}

inline StateValues values_of(const State& state) {
  const auto& [time, step, position, velocity, temperature, mass, mass_change, target_length, living, pieces, burn_time,
               mass_burnt, heat_initial, heat_in, heat_out, heat_made] = state;
  StateValues values{{"time", {time}},
                     {"step", {static_cast<double>(step)}},
                     {"position", numbers(position)},
                     {"velocity", numbers(velocity)},
                     {"temperature", numbers(temperature)},
                     {"mass", numbers(mass)},
                     {"mass_change", numbers(mass_change)},
                     {"burn_time", burn_time},
                     {"mass_burnt", {mass_burnt}},
                     {"heat_initial", {heat_initial}},
                     {"heat_in", {heat_in}},
                     {"heat_out", {heat_out}},
                     {"heat_made", {heat_made}}};
  const auto& [springs, triangles] = living;
  for (std::size_t colour = 0; colour < 4; ++colour) {
    values[std::string("target_length ") + colour_names[colour]] = target_length[colour];
    values[std::string("living springs ") + colour_names[colour]] = numbers(springs[colour]);
  }
  values["living triangles"] = numbers(triangles);
  const auto& [of_particle, present, next_id] = pieces;
  values["pieces of_particle"] = numbers(of_particle);
  values["pieces next_id"] = {static_cast<double>(next_id)};
  std::vector<double>& list = values["pieces present"];
  for (const auto& [id, birth_time] : present) {
    list.push_back(static_cast<double>(id));
    list.push_back(birth_time);
  }
  return values;
}

inline StateValues values_of(const BalloonState& state) {
  const auto& [time, step, position, velocity, thickness_ratio, pressure] = state;
  return {{"time", {time}},
          {"step", {static_cast<double>(step)}},
          {"position", numbers(position)},
          {"velocity", numbers(velocity)},
          {"thickness_ratio", thickness_ratio},
          {"pressure", numbers(pressure)}};
}

}  // namespace pellicle
