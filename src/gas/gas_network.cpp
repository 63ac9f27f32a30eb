#include "gas/gas_network.h"

#include <Eigen/SparseLU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>

#include "base/error.h"
#include "base/units.h"
#include "geometry/key_points.h"

namespace pellicle {
inline namespace gas {

namespace {

void require_key_points(const std::string& key, const Rows& rows, double lowest, double highest) {
  if (const std::string fault = fault_of_key_points(rows, {"time", "value"}); !fault.empty()) {
    throw Error(key + ": " + fault);
  }
  for (const auto& row : rows) {
    if (!(row[1] >= lowest && row[1] <= highest)) {
      throw Error(key + ": " + number_text(row[1]) + " at " + number_text(row[0]) + " s, expected at least " +
                  number_text(lowest) + (std::isfinite(highest) ? " and at most " + number_text(highest) : ""));
    }
  }
}

void require_valid(const std::string& name, const LinkOptions& options) {
  if (options.area.has_value() == !options.flow.empty()) {
    throw Error(name + ": " + (options.area ? "both" : "neither") + " area " + (options.area ? "and" : "nor") +
                " flow given, expected one of them");
  }
  if (!options.opens.empty()) {
    require_key_points(name + ".opens", options.opens, 0, 1);
  }
  if (!options.flow.empty()) {
    require_key_points(name + ".flow", options.flow, 0, std::numeric_limits<double>::infinity());
  }
}

/// What depends on one vessel's amount, heat and volume, in this order.
using ByState = std::array<double, 3>;

/// Whether the residual of the equations is only the rounding of amounts and heats. That can be large where a wide link
/// turns a small difference of pressures into a large flow.
bool is_rounding(const Eigen::VectorXd& rest, const Eigen::SparseMatrix<double>& jacobian,
                 const std::vector<VesselGas>& gas) {
  constexpr double share = 4 * std::numeric_limits<double>::epsilon();
  Eigen::VectorXd values(rest.size());
  for (std::size_t v = 0; v < gas.size(); ++v) {
    values.segment<2>(static_cast<Eigen::Index>(2 * v)) = Eigen::Vector2d(gas[v].amount, gas[v].heat);
  }
  const Eigen::VectorXd rounding = share * (jacobian.cwiseAbs() * values.cwiseAbs());
  return (rest.array().abs() <= rounding.array()).all();
}

}  // namespace

/// Pressure and temperature of a vessel, and by what they change.
struct GasNetwork::Local {
  double pressure = 0;
  double temperature = 0;
  ByState pressure_by{};
  ByState temperature_by{};
};

/// A flow between two ends, its temperature upstream, and their derivatives by the states of the ends.
struct GasNetwork::Flow {
  double flow = 0;  ///< [mol/s]
  double temperature = 0;
  ByState by_from{};
  ByState by_to{};
  ByState temperature_by_from{};
  ByState temperature_by_to{};
};

/// The residual of the equations of a step, amounts and heats vessel after vessel, and their derivatives.
struct GasNetwork::Balance {
  Eigen::VectorXd rest;                        ///< (2 x vessels)
  std::vector<Eigen::Triplet<double>> by_gas;  ///< by amount and heat
  std::vector<Eigen::Triplet<double>> by_volume;
  std::vector<Local> local;
  // What flows through links and leaks, and what walls give, in the step.
  Eigen::VectorXd flow;           ///< [mol]
  Eigen::VectorXd enthalpy;       ///< [J]
  Eigen::VectorXd leak;           ///< [mol]
  Eigen::VectorXd leak_enthalpy;  ///< [J]
  Eigen::VectorXd wall_heat;      ///< [J]
};

GasNetwork::GasNetwork(std::vector<Vessel> vessels, std::vector<Link> links, const GasOptions& gas)
    : vessels_(std::move(vessels)), links_(std::move(links)), gas_(gas) {
  for (const Link& link : links_) {
    require_valid("gas_network.links." + link.name, link.options);
    if (link.from == link.to) {
      throw Error("gas_network.links." + link.name +
                  ": from and to are the same, expected a chamber at one end at least");
    }
    if (link.from != ambient && link.to != ambient && vessel(link.from).gamma != vessel(link.to).gamma) {
      throw Error("gas_network.links." + link.name + ": joins chambers of unlike gamma, expected one gas");
    }
  }
}

GasNetwork::Local GasNetwork::local(int number, const Step& step, const VesselGas& gas) const {
  const Vessel& self = vessel(number);
  const double volume = step.volume[number];
  Local local;
  if (self.keeps_temperature) {
    local.temperature = step.temperature[number];
    local.pressure = gas.amount * gas_constant * local.temperature / volume;
    local.pressure_by = {gas_constant * local.temperature / volume, 0, -local.pressure / volume};
    return local;
  }
  const double compression = std::pow(volume / self.reference_volume, self.gamma - 1);
  const double share = gas_constant / (compression * volume);
  local.pressure = gas.heat * share;
  local.pressure_by = {0, share, -self.gamma * local.pressure / volume};
  local.temperature = gas.heat / (gas.amount * compression);
  local.temperature_by = {-local.temperature / gas.amount, 1 / (gas.amount * compression),
                          -(self.gamma - 1) * local.temperature / volume};
  return local;
}

GasNetwork::Local GasNetwork::ambient_state() const {
  Local outside;
  outside.pressure = gas_.ambient_pressure;
  outside.temperature = gas_.ambient_temperature;
  return outside;
}

GasNetwork::Flow GasNetwork::through_orifice(double area, double gamma, const Local& from, const Local& to) const {
  const bool is_forward = from.pressure >= to.pressure;
  const Local& up = is_forward ? from : to;
  const Local& down = is_forward ? to : from;
  const OrificeFlow orifice = orifice_flow(area, up.pressure, down.pressure, up.temperature, gamma, gas_.molar_mass);
  const double sign = is_forward ? 1 : -1;
  Flow result;
  result.flow = sign * orifice.flow;
  result.temperature = up.temperature;
  (is_forward ? result.temperature_by_from : result.temperature_by_to) = up.temperature_by;
  for (std::size_t k = 0; k < up.pressure_by.size(); ++k) {
    (is_forward ? result.by_from : result.by_to)[k] =
        sign * (orifice.by_upstream * up.pressure_by[k] + orifice.by_temperature * up.temperature_by[k]);
    (is_forward ? result.by_to : result.by_from)[k] = sign * orifice.by_downstream * down.pressure_by[k];
  }
  return result;
}

GasNetwork::Balance GasNetwork::balance(const Step& step, const std::vector<VesselGas>& gas) const {
  Balance result;
  result.rest.resize(2 * count());
  result.flow.setZero(static_cast<Eigen::Index>(links_.size()));
  result.enthalpy = result.flow;
  result.leak.setZero(count());
  result.leak_enthalpy = result.leak;
  result.wall_heat = result.leak;
  for (int i = 0; i < count(); ++i) {
    const auto v = static_cast<std::size_t>(i);
    result.local.push_back(local(i, step, gas[v]));
    result.rest[2 * i] = gas[v].amount - step.gas[v].amount;
    result.rest[2 * i + 1] = vessel(i).keeps_temperature ? 0 : gas[v].heat - step.gas[v].heat;
    result.by_gas.emplace_back(2 * i, 2 * i, 1);
    result.by_gas.emplace_back(2 * i + 1, 2 * i + 1, 1);
  }
  const auto add_derivatives = [&](int row, double factor, int of, const ByState& by) {
    if (of != ambient) {
      result.by_gas.emplace_back(row, 2 * of, factor * by[0]);
      result.by_gas.emplace_back(row, 2 * of + 1, factor * by[1]);
      result.by_volume.emplace_back(row, of, factor * by[2]);
    }
  };
  /// Adds to the heat of a vessel an energy flow [J/s], given with its derivatives by the states of some vessels.
  const auto add_heat = [&](int of, double energy, const std::vector<std::pair<int, ByState>>& by) {
    if (vessel(of).keeps_temperature) {
      return;
    }
    const double middle = std::sqrt(step.start_volume[of] * step.volume[of]);
    const double compression = std::pow(middle / vessel(of).reference_volume, vessel(of).gamma - 1);
    const double factor = -step.h * compression / heat_capacity(of);
    result.rest[2 * of + 1] += factor * energy;
    for (const auto& [other, derivatives] : by) {
      add_derivatives(2 * of + 1, factor, other, derivatives);
    }
    add_derivatives(2 * of + 1, factor * energy, of, {0, 0, (vessel(of).gamma - 1) / (2 * step.volume[of])});
  };
  const auto add_flow = [&](int from, int to, const Flow& flow, double& amount, double& enthalpy) {
    const double gamma = vessel(from != ambient ? from : to).gamma;
    const double capacity = gas_constant * gamma / (gamma - 1);  // c_p
    amount = step.h * flow.flow;
    enthalpy = amount * capacity * flow.temperature;
    for (const auto& [into, sign] : {std::pair(from, -1.0), std::pair(to, 1.0)}) {
      if (into == ambient) {
        continue;
      }
      std::vector<std::pair<int, ByState>> energy_by;
      for (const auto& [other, flow_by, temperature_by] : {std::tuple(from, flow.by_from, flow.temperature_by_from),
                                                           std::tuple(to, flow.by_to, flow.temperature_by_to)}) {
        add_derivatives(2 * into, -sign * step.h, other, flow_by);
        ByState by{};
        for (std::size_t k = 0; k < by.size(); ++k) {
          by[k] = sign * capacity * (flow.temperature * flow_by[k] + flow.flow * temperature_by[k]);
        }
        energy_by.emplace_back(other, by);
      }
      result.rest[2 * into] -= sign * amount;
      add_heat(into, sign * flow.flow * capacity * flow.temperature, energy_by);
    }
  };

  const Local outside = ambient_state();
  const auto local_of = [&](int number) -> const Local& { return number == ambient ? outside : result.local[number]; };
  for (std::size_t l = 0; l < links_.size(); ++l) {
    const Link& link = links_[l];
    const LinkOptions& options = link.options;
    Flow flow;
    if (options.area) {
      const double open = options.opens.empty() ? 1 : value_on_key_points(options.opens, step.time);
      const int any = link.from != ambient ? link.from : link.to;
      flow = through_orifice(*options.area * options.discharge * open, vessel(any).gamma, local_of(link.from),
                             local_of(link.to));
      if (options.one_way && flow.flow < 0) {
        flow = {};
      }
    } else {
      flow.flow = value_on_key_points(options.flow, step.time);
      flow.temperature = local_of(link.from).temperature;
      flow.temperature_by_from = local_of(link.from).temperature_by;
      if (link.from == ambient && options.temperature) {
        flow.temperature = *options.temperature;
      }
    }
    const auto row = static_cast<Eigen::Index>(l);
    add_flow(link.from, link.to, flow, result.flow[row], result.enthalpy[row]);
  }
  for (const Leak& leak : step.leaks) {
    Local there = local_of(leak.vessel);
    there.pressure += leak.rise;
    const Flow flow = through_orifice(leak.area, vessel(leak.vessel).gamma, there, local_of(leak.outside));
    double amount = 0;
    double enthalpy = 0;
    add_flow(leak.vessel, leak.outside, flow, amount, enthalpy);
    for (const auto& [end, sign] : {std::pair(leak.vessel, 1.0), std::pair(leak.outside, -1.0)}) {
      if (end != ambient) {
        result.leak[end] += sign * amount;
        result.leak_enthalpy[end] += sign * enthalpy;
      }
    }
  }
  for (int i = 0; i < count() && step.conductance.size() > 0; ++i) {
    const Local& self = local_of(i);
    const double conductance = step.conductance[i];
    const double heat = conductance * (step.wall_temperature[i] - self.temperature);
    result.wall_heat[i] = step.h * heat;
    ByState by = self.temperature_by;
    for (double& value : by) {
      value *= -conductance;
    }
    add_heat(i, heat, {{i, by}});
  }
  return result;
}

GasNetwork::End GasNetwork::solve(const Step& step) const {
  constexpr int most_iterations = 100;
  constexpr double rounding = 1e-14;   // shares of amounts and heats: at which iterations end,
  constexpr double tolerance = 1e-9;   // and at which they have converged, where rounding allows no more
  constexpr double most_rounding = 1;  // and what rounding may leave of them where links are very wide
  constexpr double most_lost = 0.9;    // of what a vessel has, in an iteration
  // Factor by which a whole iteration has to reduce the residual: between flows like the square root of a difference of
  // pressures, forwards and backwards, Newton's method jumps back and forth.
  constexpr double least_gain = 0.1;
  std::vector<VesselGas> gas = step.gas;
  Eigen::VectorXd scale(2 * count());
  for (int i = 0; i < count(); ++i) {
    const VesselGas& start = gas[i];
    const double heat = std::max(gas_.ambient_pressure * vessel(i).reference_volume / gas_constant, start.heat);
    scale[2 * i] = std::max(heat / gas_.ambient_temperature, start.amount);
    scale[2 * i + 1] = heat > 0 ? heat : 1;
  }
  const auto size = [&](const Eigen::VectorXd& values) {
    return values.cwiseQuotient(scale).lpNorm<Eigen::Infinity>();
  };
  Balance balance = this->balance(step, gas);
  double moved = 0;
  for (int iteration = 0; iteration < most_iterations; ++iteration) {
    Eigen::SparseMatrix<double> jacobian(2 * count(), 2 * count());
    jacobian.setFromTriplets(balance.by_gas.begin(), balance.by_gas.end());
    if (is_rounding(balance.rest, jacobian, gas)) {
      moved = size(balance.rest) <= most_rounding ? 0 : std::numeric_limits<double>::infinity();
      break;
    }
    const Eigen::SparseLU<Eigen::SparseMatrix<double>> factor(jacobian);
    moved = std::numeric_limits<double>::infinity();
    if (factor.info() != Eigen::Success) {
      break;
    }
    const Eigen::VectorXd descent = factor.solve(balance.rest);
    moved = size(descent);
    if (!(moved > rounding)) {
      break;
    }
    double share = 1;
    for (Eigen::Index k = 0; k < descent.size(); ++k) {
      const VesselGas& has = gas[k / 2];
      share = std::min(share, most_lost * (k % 2 == 0 ? has.amount : has.heat) / std::max(descent[k], 1e-300));
    }
    const auto moved_by = [&](double part) {
      std::vector<VesselGas> result = gas;
      for (std::size_t v = 0; v < result.size(); ++v) {
        result[v].amount -= part * descent[static_cast<Eigen::Index>(2 * v)];
        result[v].heat -= part * descent[static_cast<Eigen::Index>(2 * v + 1)];
      }
      return result;
    };
    const double rest = size(balance.rest);
    std::vector<VesselGas> next = moved_by(share);
    Balance there = this->balance(step, next);
    while (!(size(there.rest) < (1 - least_gain * share) * rest) && share * moved > rounding) {
      share /= 2;
      next = moved_by(share);
      there = this->balance(step, next);
    }
    if (!(size(there.rest) < rest)) {  // Rounding is all that is left.
      break;
    }
    gas = std::move(next);
    balance = std::move(there);
  }
  End end;
  end.converged = moved <= tolerance;
  end.gas = std::move(gas);
  end.flow = std::move(balance.flow);
  end.enthalpy = std::move(balance.enthalpy);
  end.leak = std::move(balance.leak);
  end.leak_enthalpy = std::move(balance.leak_enthalpy);
  end.wall_heat = std::move(balance.wall_heat);
  end.pressure.setConstant(count(), std::numeric_limits<double>::quiet_NaN());
  end.temperature = end.pressure;
  for (int i = 0; i < count() && end.converged; ++i) {
    end.pressure[i] = balance.local[i].pressure;
    end.temperature[i] = balance.local[i].temperature;
  }
  return end;
}

Eigen::MatrixXd GasNetwork::slopes(const Step& step, const End& end) const {
  const Balance balance = this->balance(step, end.gas);
  Eigen::SparseMatrix<double> by_gas(2 * count(), 2 * count());
  by_gas.setFromTriplets(balance.by_gas.begin(), balance.by_gas.end());
  Eigen::SparseMatrix<double> by_volume(2 * count(), count());
  by_volume.setFromTriplets(balance.by_volume.begin(), balance.by_volume.end());
  const Eigen::SparseLU<Eigen::SparseMatrix<double>> factor(by_gas);
  const Eigen::MatrixXd moved = factor.solve(Eigen::MatrixXd(by_volume));
  Eigen::MatrixXd result(count(), count());
  for (int i = 0; i < count(); ++i) {
    const ByState& by = balance.local[i].pressure_by;
    result.row(i) = -by[0] * moved.row(2 * i) - by[1] * moved.row(2 * i + 1);
    result(i, i) += by[2];
  }
  return result;
}

}  // namespace gas
}  // namespace pellicle
