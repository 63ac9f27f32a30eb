#include "world/gas_of_object.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "io/console.h"
#include "parallel/collective.h"

namespace pellicle {
inline namespace world {

namespace {

/// How many chambers there were before any was cut in two; they come first.
int chambers_at_first(const Chambers& chambers) {
  int count = 0;
  while (count < chambers.count() && chambers.was_there_at_first(count)) {
    ++count;
  }
  return count;
}

}  // namespace

std::vector<History::Column> gas_columns(const Chambers& chambers) {
  std::vector<History::Column> columns{{"gas_volume", "m^3"},  {"gas_volume_ratio", ""},
                                       {"gas_pressure", "Pa"}, {"gas_absolute_pressure", "Pa"},
                                       {"gas_amount", "mol"},  {"gas_temperature", "K"}};
  const int several = chambers_at_first(chambers);
  for (int chamber = 0; chamber < (several > 1 ? several : 0); ++chamber) {
    const std::string& name = chambers.name(chamber);
    const std::string owner = "chambers." + name;
    columns.push_back({"gas_volume_" + name, "m^3", owner});
    columns.push_back({"gas_pressure_" + name, "Pa", owner});
    columns.push_back({"gas_amount_" + name, "mol", owner});
    columns.push_back({"gas_temperature_" + name, "K", owner});
  }
  if (chambers.has_network()) {
    columns.insert(columns.end(), {{"gas_energy", "J"},
                                   {"gas_work", "J"},
                                   {"gas_wall_heat", "J"},
                                   {"gas_leak", "mol"},
                                   {"gas_leak_enthalpy", "J"}});
  }
  for (const Chambers::Link& link : chambers.links()) {
    columns.push_back({"through_" + link.name, "mol", "gas_network.links." + link.name});
    columns.push_back({"enthalpy_" + link.name, "J", "gas_network.links." + link.name});
  }
  return columns;
}

std::vector<double> gas_values(const Chambers& chambers, const ObjectState& state, const double* pressure,
                               double time) {
  // Several chambers: volumes and amounts add up, pressures and temperatures are means by volume.
  const int several = chambers_at_first(chambers);
  const GasExchange& exchange = exchange_of(chambers, state);
  const Eigen::VectorXd walls = chambers.volumes(state.position);
  const Eigen::VectorXd volumes = exchange.gas_volumes(walls);
  const std::vector<GasState> states = chambers.states(exchange, walls, time);
  GasState all;
  double initial_volume = 0;
  double energy = 0;  // of the joined chambers
  std::vector<double> of_chambers;
  for (int chamber = 0; chamber < chambers.count(); ++chamber) {
    GasState gas = states[chamber];
    gas.pressure = chambers.prescribes_volume(chamber) ? pressure[chamber] : gas.pressure;
    const double share = chambers.count() == 1 ? 1 : volumes[chamber] / volumes.sum();
    all.volume += gas.volume;
    all.amount += gas.amount;
    all.pressure += share * gas.pressure;
    all.absolute_pressure += share * gas.absolute_pressure;
    all.temperature += share * gas.temperature;
    if (chambers.was_there_at_first(chamber)) {
      initial_volume += chambers.initial_volume(chamber);
    }
    if (several > 1 && chamber < several) {
      of_chambers.push_back(gas.volume);
      of_chambers.push_back(gas.pressure);
      of_chambers.push_back(gas.amount);
      of_chambers.push_back(gas.temperature);
    }
    if (chambers.is_joined(chamber)) {
      energy += gas.amount * chambers.heat_capacity(chamber) * gas.temperature;
    }
  }
  std::vector<double> values{all.volume,   initial_volume != 0 ? all.volume / initial_volume : 0,
                             all.pressure, all.absolute_pressure,
                             all.amount,   all.temperature};
  values.insert(values.end(), of_chambers.begin(), of_chambers.end());
  if (state.gas != nullptr) {
    values.insert(values.end(), {energy, state.gas->work.sum(), state.gas->wall_heat.sum(),
                                 state.gas->leak_amount.sum(), state.gas->leak_enthalpy.sum()});
    for (Eigen::Index link = 0; link < state.gas->link_amount.size(); ++link) {
      values.insert(values.end(), {state.gas->link_amount[link], state.gas->link_enthalpy[link]});
    }
  }
  return values;
}

std::vector<bool> opened_chambers(const ObjectState& state) {
  std::vector<bool> opened;
  for (int chamber = 0; state.gas != nullptr && chamber < state.gas->chambers(); ++chamber) {
    opened.push_back(state.gas->is_part(chamber) || state.gas->is_open(chamber));
  }
  return opened;
}

std::vector<std::string> newly_open(const Chambers& chambers, const ObjectState& state, std::vector<bool>& reported) {
  std::vector<std::string> lines;
  const std::vector<bool> opened = opened_chambers(state);
  reported.resize(opened.size());
  for (int chamber = 0; chamber < static_cast<int>(opened.size()); ++chamber) {
    if (!opened[chamber] || reported[chamber]) {
      continue;
    }
    const std::string why = " at " + time_text(state.time) + ": its holes are large, and its pressure is that ";
    if (state.gas->is_part(chamber)) {
      lines.push_back("chamber " + chambers.name(chamber) + " becomes a part of " +
                      chambers.name(state.gas->gas_inside(chamber)) + why + "round it");
    } else {
      lines.push_back("chamber " + chambers.name(chamber) + " is open for good" + why + "outside");
    }
  }
  reported = opened;
  return lines;
}

std::vector<std::string> divide_chambers(const Chambers& chambers, const std::vector<PetscInt>& piece,
                                         ObjectState& state, std::vector<PetscInt>& numbers) {
  if (state.gas == nullptr) {
    return {};
  }
  std::optional<Chambers::Division> division = chambers.divided(piece, *state.gas, state.position, state.time);
  if (!division) {
    return {};
  }
  numbers = std::move(division->numbers);
  *state.gas = std::move(division->exchange);
  for (std::string& line : division->lines) {
    line += " at " + time_text(state.time);
  }
  return division->lines;
}

std::string hole(const Chambers& chambers, const Surface& surface, const Field& position, const BurningFields& fields) {
  constexpr PetscInt none = std::numeric_limits<PetscInt>::max();
  const auto per_element = static_cast<std::size_t>(surface.triangles_per_element);
  const auto chamber_of = [&](std::size_t e) { return chambers.of_triangle(static_cast<PetscInt>(per_element * e)); };
  PetscInt least = none;
  std::size_t found = 0;
  for (PetscInt e = 0; e < surface.elements.owned; ++e) {
    if (fields.burn_time[e] >= 0 && surface.element_id[e] < least && chamber_of(e) >= 0 &&
        chambers.needs_closed_wall(chamber_of(e))) {
      least = surface.element_id[e];
      found = e;
    }
  }
  PetscInt first = least;
  first = min_over_ranks(surface.comm(), first);
  if (first == none) {
    return "";
  }
  std::array<double, 4> place{};  // centre, chamber: of the rank that has it
  if (least == first) {
    Eigen::Vector3d x = Eigen::Vector3d::Zero();
    for (std::size_t t = per_element * found; t < per_element * (found + 1); ++t) {
      for (const PetscInt point : surface.triangles[t]) {
        x += position.vector(point) / static_cast<double>(3 * per_element);
      }
    }
    place = {x[0], x[1], x[2], static_cast<double>(chamber_of(found))};
  }
  place = sum_over_ranks(surface.comm(), place);
  std::string text = fmt::format(" is open: element {} at ({:.4g}, {:.4g}, {:.4g}) m has burnt through",
                                 static_cast<int>(first), place[0], place[1], place[2]);
  return "chamber " + chambers.name(static_cast<int>(place[3])) + text;
}

std::string torn_open(const Chambers& chambers, const Surface& surface, const Field& position,
                      const SplitCorners& corners) {
  if (corners.count == 0 || chambers.count() == 0) {
    return "";
  }
  std::map<PetscInt, int> chamber_of;  // of vertices of triangles that may not part
  for (std::size_t triangle = 0; triangle < surface.triangles.size(); ++triangle) {
    const int chamber = chambers.of_triangle(static_cast<PetscInt>(triangle));
    if (chamber >= 0 && chambers.needs_closed_wall(chamber)) {
      for (const PetscInt vertex : surface.triangles[triangle]) {
        chamber_of[vertex] = chamber;
      }
    }
  }
  std::array<double, 5> first{HUGE_VAL};  // id, place and chamber
  for (const SplitCorners::Copy& copy : corners.copies) {
    if (const auto found = chamber_of.find(copy.original); found != chamber_of.end()) {
      const double id = surface.persistent_id[copy.original];
      const Eigen::Vector3d x = position.vector(copy.original);
      first = std::min(first, {id, x[0], x[1], x[2], static_cast<double>(found->second)});
    }
  }
  const std::vector<std::array<double, 5>> all = of_all_ranks(surface.comm(), std::vector{first});
  const auto& [id, x, y, z, chamber] = *std::min_element(all.begin(), all.end());
  if (id == HUGE_VAL) {
    return "";
  }
  // A coordinate that is rounding is 0, so that the words do not depend on the ranks.
  const double rounding = 1e-9 * std::hypot(x, y, z);
  const auto shown = [rounding](double coordinate) { return std::abs(coordinate) < rounding ? 0.0 : coordinate; };
  std::string text = fmt::format(" is open: it has torn at vertex {} at ({:.4g}, {:.4g}, {:.4g}) m",
                                 static_cast<int>(id), shown(x), shown(y), shown(z));
  return "chamber " + chambers.name(static_cast<int>(chamber)) + text;
}

}  // namespace world
}  // namespace pellicle
