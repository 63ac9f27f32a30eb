#include <cmath>
#include <limits>

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

}  // namespace pellicle::gas
