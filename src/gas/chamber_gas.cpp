#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/disjoint_sets.h"
#include "gas/chambers.h"
#include "geometry/key_points.h"

namespace pellicle::gas {

GasState Chambers::state(const GasExchange& exchange, int chamber, double volume, double time) const {
  const Chamber& self = of(chamber);
  const ChamberOptions& given = self.options;
  GasState gas;
  gas.volume = volume;
  if (given.law == GasLaw::volume) {
    return gas;
  }
  if (given.law == GasLaw::pressure) {
    gas.pressure = value_on_key_points(given.pressure, time);
    gas.absolute_pressure = gas.pressure + gas_.ambient_pressure;
    gas.potential = -gas.pressure * volume;
    return gas;
  }

  const bool has_opened = is_joined(chamber) && exchange.is_open(chamber);
  const double inside = has_opened ? exchange.volume[chamber] : volume;
  const double strain = inside > 0 ? std::log(inside / self.initial_volume) : std::numeric_limits<double>::quiet_NaN();
  // An ideal gas that is compressed without exchange: the absolute pressure is (e/V0) (V0/V)^k.
  double energy = 0;  // e [J]
  double exponent = 1;
  double outside = 0;  // absolute pressure beyond the wall [Pa]
  if (given.law == GasLaw::relative) {
    energy = value_on_key_points(given.pressure, time) * self.initial_volume;
  } else {
    outside = gas_.ambient_pressure;
    exponent = given.law == GasLaw::adiabatic ? self.gamma : 1;
    const VesselGas content = vessel_gas(exchange, chamber, time);
    gas.amount = content.amount;
    gas.temperature = content.heat / content.amount * std::exp((1 - exponent) * strain);
    energy = content.heat * gas_constant;
  }
  if (has_opened) {
    gas.absolute_pressure = outside;
    return gas;
  }
  // The potential is -e ln(V/V0) or e ((V0/V)^(k-1) - 1)/(k-1), plus that of the outside.
  const double compression = std::expm1((1 - exponent) * strain);  // (V0/V)^(k-1) - 1
  gas.absolute_pressure = energy * (1 + compression) / volume;
  gas.pressure = gas.absolute_pressure - outside;
  gas.pressure_slope = -exponent * gas.absolute_pressure / volume;
  gas.potential = (exponent > 1 ? energy * compression / (exponent - 1) : -energy * strain) +
                  outside * (volume - self.initial_volume);
  return gas;
}

std::vector<GasState> Chambers::states(const GasExchange& exchange, const Eigen::VectorXd& walls, double time) const {
  std::vector<GasState> states = states_against_ambient(exchange, walls, time);
  put_across_walls(exchange, states);
  return states;
}

std::vector<GasState> Chambers::states_against_ambient(const GasExchange& exchange, const Eigen::VectorXd& walls,
                                                       double time) const {
  const Eigen::VectorXd volumes = exchange.gas_volumes(walls);
  std::vector<GasState> states(chambers_.size());
  for (int chamber = 0; chamber < count(); ++chamber) {
    if (!exchange.is_part(chamber)) {
      states[chamber] = state(exchange, chamber, volumes[chamber], time);
    }
  }
  return states;
}

void Chambers::put_across_walls(const GasExchange& exchange, std::vector<GasState>& states) {
  std::vector<double> pressure;  // against the ambient air
  for (const GasState& gas : states) {
    pressure.push_back(gas.pressure);
  }
  for (int wall = 0; wall < exchange.chambers(); ++wall) {
    const int outside = exchange.gas_outside(wall);
    states[wall].pressure = pressure[exchange.gas_inside(wall)] - (outside < 0 ? 0 : pressure[outside]);
  }
}

/// The gas of a chamber with an amount of gas, of the laws isothermal and adiabatic, with the exchange by links and
/// walls if it is joined.
VesselGas Chambers::vessel_gas(const GasExchange& exchange, int chamber, double time) const {
  const Chamber& self = of(chamber);
  const double temperature = value_on_key_points(self.options.temperature, time);
  const double given = self.unit_amount * value_on_key_points(self.options.amount, time);
  VesselGas gas{given, given * temperature};
  if (is_joined(chamber)) {
    gas.amount += exchange.amount[chamber];
    gas.heat = self.options.law == GasLaw::adiabatic ? gas.heat + exchange.heat[chamber] : gas.amount * temperature;
  }
  return gas;
}

/// The gas of all chambers between steps, at the volumes in the exchange; nothing in chambers that are not joined.
std::vector<Chambers::Content> Chambers::contents(const GasExchange& exchange, double time) const {
  std::vector<Content> all(chambers_.size(), Content::Zero());
  for (const int chamber : joined_) {
    const Chamber& self = of(chamber);
    const VesselGas gas = vessel_gas(exchange, chamber, time);
    const double expansion = self.options.law == GasLaw::isothermal
                                 ? 1
                                 : std::pow(exchange.volume[chamber] / self.initial_volume, 1 - self.gamma);
    all[chamber] = {gas.amount, gas.heat * expansion};
  }
  return all;
}

/// Sets the gas of a chamber, or of one to be added. @param like a chamber of its law and reference volume
void Chambers::fill(GasExchange& exchange, int number, int like, const Content& gas, double volume) const {
  const double given = number < count() ? first_amount(number) : 0;
  const double compression = std::pow(volume / of(like).initial_volume, of(like).gamma - 1);
  exchange.volume[number] = volume;
  exchange.amount[number] = gas[0] - given;
  exchange.heat[number] = gas[1] * compression - given * value_on_key_points(of(like).options.temperature, 0);
}

/// Moves gas through a chamber's wall, as a leak into the chamber round it or the ambient air.
void Chambers::leak_out(GasExchange& exchange, std::vector<Content>& contents, int chamber, const Content& gas) const {
  const auto add_leak = [&](int of, double sign) {
    exchange.leak_amount[of] += sign * gas[0];
    exchange.leak_enthalpy[of] += sign * heat_capacity(chamber) * gas[1];
  };
  add_leak(chamber, 1);
  if (const int round = exchange.gas_outside(chamber); round >= 0) {
    add_leak(round, -1);
    contents[round] += gas;
  }
}

double Chambers::prescribed_volume(int chamber, double time) const {
  const Chamber& self = of(chamber);
  return self.options.volume.empty() ? self.initial_volume * value_on_key_points(self.options.volume_ratio, time)
                                     : value_on_key_points(self.options.volume, time);
}

void Chambers::add_to_step(GasNetwork::Step& step, const GasStep& start, const Vessels& vessels,
                           const Eigen::VectorXd& walls, double time) const {
  using Step = GasNetwork::Step;
  const GasExchange& exchange = *start.exchange;
  const Eigen::VectorXd volumes = exchange.gas_volumes(walls);
  const Eigen::VectorXd zeros = Eigen::VectorXd::Zero(step.volume.size() + vessels.chambers.size());
  for (const auto values :
       {&Step::volume, &Step::start_volume, &Step::temperature, &Step::conductance, &Step::wall_temperature}) {
    (step.*values).conservativeResizeLike(zeros);
  }
  for (const int chamber : vessels.chambers) {
    const int vessel = vessels.number(chamber);
    const double before = exchange.volume[chamber];
    step.gas.push_back(vessel_gas(exchange, chamber, time));
    step.volume[vessel] = exchange.is_open(chamber) ? before : volumes[chamber];
    step.start_volume[vessel] = before > 0 ? before : volumes[chamber];
    step.temperature[vessel] = value_on_key_points(of(chamber).options.temperature, time);
    if (start.walls.conductance.size() > 0) {
      step.conductance[vessel] = start.walls.conductance[chamber];
      step.wall_temperature[vessel] = start.walls.temperature[chamber];
    }
  }
  for (GasNetwork::Leak leak : start.walls.leaks) {
    leak.vessel = vessels.number(leak.vessel);
    leak.outside = vessels.number(leak.outside);
    step.leaks.push_back(leak);
  }
  constexpr double wide = 1;  // [m^2]
  for (const int chamber : vessels.chambers) {
    if (exchange.is_open(chamber)) {
      step.leaks.push_back({vessels.number(chamber), wide, 0});
    }
  }
}

GasExchange Chambers::first_exchange(const Eigen::VectorXd& walls) const {
  GasExchange exchange(count(), static_cast<int>(links_.size()));
  exchange.outside = initial_exchange_.outside;
  exchange.volume = initial_exchange_.gas_volumes(walls);
  for (int chamber = 0; chamber < count(); ++chamber) {
    exchange.reference_volume[chamber] = of(chamber).initial_volume;
    exchange.first_energy[chamber] = energy(chamber, state(chamber, exchange.volume[chamber], 0));
  }
  return exchange;
}

/// Absolute pressure beyond the wall of a joined chamber at the end of a step [Pa].
double Chambers::pressure_outside(const GasExchange& exchange, const Vessels& vessels, int chamber,
                                  const GasNetwork::End& end) const {
  const int vessel = vessels.number(exchange.gas_outside(chamber));
  return vessel < 0 ? gas_.ambient_pressure : end.pressure[vessel];
}

GasExchange Chambers::end_step(const GasStep& start, const Vessels& vessels, const std::vector<int>& links,
                               const Eigen::VectorXd& walls, const Eigen::VectorXd& caps, double time,
                               const GasNetwork::End& end) const {
  constexpr double rounding = 1e-10;  // of volumes: changes less than that give no mean pressure
  const GasExchange& before = *start.exchange;
  GasExchange exchange = before;
  const Eigen::VectorXd volumes = before.gas_volumes(walls);
  for (int chamber = 0; chamber < count(); ++chamber) {
    exchange.volume[chamber] = before.is_open(chamber) ? before.volume[chamber] : volumes[chamber];
  }
  Eigen::VectorXd energy = end.wall_heat - end.leak_enthalpy;  // into each vessel [J]
  for (std::size_t link = 0; link < links.size(); ++link) {
    if (links[link] < 0) {
      continue;
    }
    const double amount = end.flow[links[link]];
    const double enthalpy = end.enthalpy[links[link]];
    exchange.link_amount[link] += amount;
    exchange.link_enthalpy[link] += enthalpy;
    for (const auto& [chamber, sign] : {std::pair(links_[link].from, -1.0), std::pair(links_[link].to, 1.0)}) {
      if (chamber >= 0) {
        exchange.amount[exchange.gas_inside(chamber)] += sign * amount;
        energy[vessels.number(chamber)] += sign * enthalpy;
      }
    }
  }
  for (const int chamber : vessels.chambers) {
    const int vessel = vessels.number(chamber);
    exchange.amount[chamber] -= end.leak[vessel];
    exchange.leak_amount[chamber] += end.leak[vessel];
    exchange.leak_enthalpy[chamber] += end.leak_enthalpy[vessel];
    exchange.wall_heat[chamber] += end.wall_heat[vessel];
    const double from = before.volume[chamber];
    const double to = exchange.volume[chamber];
    const double end_heat = end.gas[vessel].amount * end.temperature[vessel];
    const double heat = vessel_gas(before, chamber, time).heat;
    const auto [gained, work] = energy_balance(chamber, from, to, heat, end_heat, energy[vessel]);
    exchange.heat[chamber] += gained;
    // A cap that moves pushes away the gas beyond it, against the pressure there. This is no work on the wall.
    const double mean = std::abs(to - from) > rounding * from ? work / (to - from) : end.pressure[vessel];
    const double beyond = (mean - pressure_outside(before, vessels, chamber, end)) * caps[chamber];
    exchange.work[chamber] += work - beyond;
    exchange.leak_enthalpy[chamber] += beyond;
  }
  open_chambers(exchange, start, vessels, time, end);
  return exchange;
}

/// Energy balance of a joined chamber in a step, as in GasNetwork.
/// @param from V at the beginning @param to V at the end [m^3] @param heat VesselGas::heat at the beginning [mol K]
/// @param end_heat n T at the end [mol K] @param energy that came in [J]
/// @returns the heat that the gas gains, as VesselGas::heat [mol K], and the work that it does [J]
std::pair<double, double> Chambers::energy_balance(int chamber, double from, double to, double heat, double end_heat,
                                                   double energy) const {
  const Chamber& self = of(chamber);
  if (self.options.law == GasLaw::isothermal) {
    return {0, (heat + end_heat) / 2 * gas_constant * std::log(to / from)};
  }
  const double capacity = heat_capacity(chamber);
  const auto colder = [&self](double volume) { return std::pow(volume / self.initial_volume, 1 - self.gamma); };
  const double middle = colder(std::sqrt(from * to));
  const double more = energy / (capacity * middle);
  return {more, capacity * (heat * (colder(from) - middle) + (heat + more) * (middle - colder(to)))};
}

/// Opens chambers with large holes permanently; a chamber inside another becomes a part of that one.
void Chambers::open_chambers(GasExchange& exchange, const GasStep& start, const Vessels& vessels, double time,
                             const GasNetwork::End& end) const {
  constexpr double large_hole = 0.1;  // fraction of what is left of the wall
  constexpr double level = 1e-5;      // fraction of the ambient pressure
  const GasExchange& before = *start.exchange;
  for (const int chamber : vessels.chambers) {
    const double there = pressure_outside(before, vessels, chamber, end);
    const bool is_level = std::abs(end.pressure[vessels.number(chamber)] - there) <= level * gas_.ambient_pressure;
    const double limit = (is_level ? large_hole : 1) * start.walls.area[chamber];
    if (!vents(chamber) || !(start.walls.hole_area[chamber] > limit)) {
      continue;
    }
    if (before.gas_outside(chamber) < 0) {
      exchange.open[chamber] = 1;
      continue;
    }
    const int round = exchange.gas_outside(chamber);
    const std::vector<Content> contents = this->contents(exchange, time);
    const double volume = exchange.volume[chamber] + exchange.volume[round];
    fill(exchange, round, round, contents[chamber] + contents[round], volume);
    fill(exchange, chamber, chamber, Content::Zero(), 0);
    std::replace(exchange.inside.begin(), exchange.inside.end(), PetscInt(chamber), PetscInt(round));
  }
}

GasExchange Chambers::recapped(const GasExchange& exchange, const Eigen::VectorXd& walls, double time) const {
  const Eigen::VectorXd volumes = exchange.gas_volumes(walls);
  const std::vector<int> order = exchange.from_within();
  // Increase of the volume within each wall since the end of the last step.
  const Eigen::VectorXd more = exchange.within_walls(volumes - exchange.volume);
  GasExchange result = exchange;
  std::vector<Content> contents = this->contents(exchange, time);
  std::vector<bool> is_changed(chambers_.size());
  for (const int chamber : order) {
    const double before = exchange.volume[chamber];
    const double fraction = -more[chamber] / before;  // that is outside now
    if (!vents(chamber) || exchange.is_open(chamber) || fraction == 0 || !(before > 0 && volumes[chamber] > 0)) {
      continue;
    }
    const Content moved = fraction * contents[chamber];
    contents[chamber] -= moved;
    leak_out(result, contents, chamber, moved);
    is_changed[chamber] = true;
    if (const int round = exchange.gas_outside(chamber); round >= 0) {
      is_changed[round] = true;
    } else {  // The air comes where the gas was, or goes from there, as in end_step.
      const double by_air = gas_.ambient_pressure * more[chamber];
      result.work[chamber] += by_air;
      result.leak_enthalpy[chamber] -= by_air;
    }
  }
  for (const int chamber : order) {
    if (is_changed[chamber]) {
      const double volume = exchange.is_open(chamber) ? exchange.volume[chamber] : volumes[chamber];
      fill(result, chamber, chamber, contents[chamber], volume);
    }
  }
  return result;
}

std::string Chambers::imbalance(const GasExchange& exchange, const Eigen::VectorXd& walls, double time) const {
  constexpr double tolerance = 1e-10;
  const std::vector<GasState> gas = states(exchange, walls, time);
  DisjointSets together(chambers_.size());  // with parts cut off it, and the one it is a part of
  for (int chamber = 0; chamber < count(); ++chamber) {
    together.unite(chamber, exchange.gas_inside(chamber));
    if (of(chamber).parent >= 0) {
      together.unite(chamber, of(chamber).parent);
    }
  }
  // Residuals of amount and energy, in the column of the first chamber of those checked together: of all terms the sum,
  // which is 0 if the balance closes, and the sum of the absolute values.
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(2, count());
  Eigen::MatrixXd scale = sum;
  std::vector<bool> keeps_temperature(chambers_.size());
  const auto add = [&](int row, int chamber, double value) {
    const std::size_t first = together.find(chamber);
    sum(row, first) += value;
    scale(row, first) += std::abs(value);
  };
  for (const int chamber : joined_) {
    add(0, chamber, first_amount(chamber) + exchange.amount[chamber]);
    add(0, chamber, exchange.leak_amount[chamber] - first_amount(chamber));
    add(1, chamber, energy(chamber, gas[chamber]));
    for (const double less : {exchange.first_energy[chamber], exchange.wall_heat[chamber], -exchange.work[chamber],
                              -exchange.leak_enthalpy[chamber]}) {
      add(1, chamber, -less);
    }
    if (of(chamber).options.law == GasLaw::isothermal) {
      keeps_temperature[together.find(chamber)] = true;
    }
  }
  for (Eigen::Index link = 0; link < exchange.link_amount.size(); ++link) {
    for (const auto& [end, sign] : {std::pair(links_[link].from, 1.0), std::pair(links_[link].to, -1.0)}) {
      if (end >= 0) {
        add(0, end, sign * exchange.link_amount[link]);
        add(1, end, sign * exchange.link_enthalpy[link]);
      }
    }
  }
  for (const int chamber : joined_) {
    for (const int row : {0, 1}) {
      const double most = tolerance * scale(row, chamber);
      if ((row == 0 || !keeps_temperature[chamber]) && !(std::abs(sum(row, chamber)) <= most)) {
        return fmt::format("the ledger of the {} in chamber {} is off by {:.2g} {}, expected at most {:.2g}",
                           row == 0 ? "amount" : "energy", name(chamber), sum(row, chamber), row == 0 ? "mol" : "J",
                           most);
      }
    }
  }
  return "";
}

}  // namespace pellicle::gas
