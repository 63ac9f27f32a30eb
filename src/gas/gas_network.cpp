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

/// Derivatives by one vessel's amount, heat and volume, in this order.
using ByState = std::array<double, 3>;

/// Whether the residual of the equations is only the rounding of amounts and heats. That can be large where a wide link
/// turns a small difference of pressures into a large flow.
bool is_rounding(const Eigen::VectorXd& rest, const Eigen::SparseMatrix<double>& jacobian,
                 const std::vector<VesselGas>& gas) {
  constexpr double fraction = 4 * std::numeric_limits<double>::epsilon();
  Eigen::VectorXd values(rest.size());
  for (std::size_t v = 0; v < gas.size(); ++v) {
    values.segment<2>(static_cast<Eigen::Index>(2 * v)) = Eigen::Vector2d(gas[v].amount, gas[v].heat);
  }
  const Eigen::VectorXd rounding = fraction * (jacobian.cwiseAbs() * values.cwiseAbs());
  return (rest.array().abs() <= rounding.array()).all();
}

/// Largest share, at most 1, of a descent (amount and heat of each vessel) that leaves each vessel a tenth of its gas.
double largest_share(const std::vector<VesselGas>& gas, const Eigen::VectorXd& descent) {
  constexpr double most_lost = 0.9;
  double fraction = 1;
  for (Eigen::Index k = 0; k < descent.size(); ++k) {
    const VesselGas& has = gas[k / 2];
    fraction = std::min(fraction, most_lost * (k % 2 == 0 ? has.amount : has.heat) / std::max(descent[k], 1e-300));
  }
  return fraction;
}

/// The gas after a fraction of a descent.
std::vector<VesselGas> moved_by(std::vector<VesselGas> gas, const Eigen::VectorXd& descent, double fraction) {
  for (std::size_t v = 0; v < gas.size(); ++v) {
    gas[v].amount -= fraction * descent[static_cast<Eigen::Index>(2 * v)];
    gas[v].heat -= fraction * descent[static_cast<Eigen::Index>(2 * v + 1)];
  }
  return gas;
}

}  // namespace

/// Pressure and temperature of a vessel, and their derivatives.
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
  // Flows through links and leaks, and heat of the walls, in the step.
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
  const double fraction = gas_constant / (compression * volume);
  local.pressure = gas.heat * fraction;
  local.pressure_by = {0, fraction, -self.gamma * local.pressure / volume};
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

/// Assembles the balances of amount and energy of all vessels in a step, term by term.
class GasNetwork::Assembly {
 public:
  Assembly(const GasNetwork& network, const Step& step, const std::vector<VesselGas>& gas)
      : network_(network), step_(step), outside_(network.ambient_state()) {
    const int count = network.count();
    balance_.rest.resize(2 * count);
    balance_.flow.setZero(static_cast<Eigen::Index>(network.links_.size()));
    balance_.enthalpy = balance_.flow;
    balance_.leak.setZero(count);
    balance_.leak_enthalpy = balance_.leak;
    balance_.wall_heat = balance_.leak;
    for (int vessel = 0; vessel < count; ++vessel) {
      add_storage(vessel, gas[vessel]);
    }
  }

  void add_links();
  void add_leaks();
  void add_wall_heat();
  Balance&& result() && { return std::move(balance_); }

 private:
  /// The derivatives of a quantity by the states of some vessels.
  using Derivatives = std::vector<std::pair<int, ByState>>;

  void add_storage(int vessel, const VesselGas& gas);
  void add_derivatives(int row, double factor, int of, const ByState& by);
  void add_energy(int of, double energy, const Derivatives& by);
  void add_flow(int from, int to, const Flow& flow, double& amount, double& enthalpy);
  Flow through_link(const Link& link) const;
  const Local& local_of(int number) const { return number == ambient ? outside_ : balance_.local[number]; }

  const GasNetwork& network_;
  const Step& step_;
  const Local outside_;
  Balance balance_;
};

/// Adds the change of amount and heat since the beginning of the step.
void GasNetwork::Assembly::add_storage(int vessel, const VesselGas& gas) {
  const VesselGas& start = step_.gas[vessel];
  balance_.local.push_back(network_.local(vessel, step_, gas));
  balance_.rest[2 * vessel] = gas.amount - start.amount;
  balance_.rest[2 * vessel + 1] = network_.vessel(vessel).keeps_temperature ? 0 : gas.heat - start.heat;
  balance_.by_gas.emplace_back(2 * vessel, 2 * vessel, 1);
  balance_.by_gas.emplace_back(2 * vessel + 1, 2 * vessel + 1, 1);
}

void GasNetwork::Assembly::add_derivatives(int row, double factor, int of, const ByState& by) {
  if (of != ambient) {
    balance_.by_gas.emplace_back(row, 2 * of, factor * by[0]);
    balance_.by_gas.emplace_back(row, 2 * of + 1, factor * by[1]);
    balance_.by_volume.emplace_back(row, of, factor * by[2]);
  }
}

/// Adds a flow of energy [J/s] and its derivatives to the energy balance of a vessel.
void GasNetwork::Assembly::add_energy(int of, double energy, const Derivatives& by) {
  const Vessel& vessel = network_.vessel(of);
  if (vessel.keeps_temperature) {
    return;
  }
  const double middle = std::sqrt(step_.start_volume[of] * step_.volume[of]);
  const double compression = std::pow(middle / vessel.reference_volume, vessel.gamma - 1);
  const double factor = -step_.h * compression / network_.heat_capacity(of);
  balance_.rest[2 * of + 1] += factor * energy;
  for (const auto& [other, derivatives] : by) {
    add_derivatives(2 * of + 1, factor, other, derivatives);
  }
  add_derivatives(2 * of + 1, factor * energy, of, {0, 0, (vessel.gamma - 1) / (2 * step_.volume[of])});
}

/// Adds a flow to the mass balances of the vessels at its ends, and its enthalpy to their energy balances.
/// @param amount set to the flow in the step [mol] @param enthalpy set to the carried enthalpy [J]
void GasNetwork::Assembly::add_flow(int from, int to, const Flow& flow, double& amount, double& enthalpy) {
  const double gamma = network_.vessel(from != ambient ? from : to).gamma;
  const double capacity = gas_constant * gamma / (gamma - 1);  // c_p
  amount = step_.h * flow.flow;
  enthalpy = amount * capacity * flow.temperature;
  for (const auto& [into, sign] : {std::pair(from, -1.0), std::pair(to, 1.0)}) {
    if (into == ambient) {
      continue;
    }
    Derivatives energy_by;
    for (const auto& [other, flow_by, temperature_by] : {std::tuple(from, flow.by_from, flow.temperature_by_from),
                                                         std::tuple(to, flow.by_to, flow.temperature_by_to)}) {
      add_derivatives(2 * into, -sign * step_.h, other, flow_by);
      ByState by{};
      for (std::size_t k = 0; k < by.size(); ++k) {
        by[k] = sign * capacity * (flow.temperature * flow_by[k] + flow.flow * temperature_by[k]);
      }
      energy_by.emplace_back(other, by);
    }
    balance_.rest[2 * into] -= sign * amount;
    add_energy(into, sign * flow.flow * capacity * flow.temperature, energy_by);
  }
}

/// The flow of a link: through its orifice, or that of its pump.
GasNetwork::Flow GasNetwork::Assembly::through_link(const Link& link) const {
  const LinkOptions& options = link.options;
  if (options.area) {
    const double open = options.opens.empty() ? 1 : value_on_key_points(options.opens, step_.time);
    const int any = link.from != ambient ? link.from : link.to;
    const double area = *options.area * options.discharge * open;
    const Flow flow =
        network_.through_orifice(area, network_.vessel(any).gamma, local_of(link.from), local_of(link.to));
    return options.one_way && flow.flow < 0 ? Flow() : flow;
  }
  Flow flow;
  flow.flow = value_on_key_points(options.flow, step_.time);
  flow.temperature = local_of(link.from).temperature;
  flow.temperature_by_from = local_of(link.from).temperature_by;
  if (link.from == ambient && options.temperature) {
    flow.temperature = *options.temperature;
  }
  return flow;
}

void GasNetwork::Assembly::add_links() {
  for (std::size_t l = 0; l < network_.links_.size(); ++l) {
    const Link& link = network_.links_[l];
    const auto row = static_cast<Eigen::Index>(l);
    add_flow(link.from, link.to, through_link(link), balance_.flow[row], balance_.enthalpy[row]);
  }
}

void GasNetwork::Assembly::add_leaks() {
  for (const Leak& leak : step_.leaks) {
    Local there = local_of(leak.vessel);
    there.pressure += leak.rise;
    const double gamma = network_.vessel(leak.vessel).gamma;
    const Flow flow = network_.through_orifice(leak.area, gamma, there, local_of(leak.outside));
    double amount = 0;
    double enthalpy = 0;
    add_flow(leak.vessel, leak.outside, flow, amount, enthalpy);
    for (const auto& [end, sign] : {std::pair(leak.vessel, 1.0), std::pair(leak.outside, -1.0)}) {
      if (end != ambient) {
        balance_.leak[end] += sign * amount;
        balance_.leak_enthalpy[end] += sign * enthalpy;
      }
    }
  }
}

void GasNetwork::Assembly::add_wall_heat() {
  for (int vessel = 0; vessel < network_.count() && step_.conductance.size() > 0; ++vessel) {
    const Local& self = local_of(vessel);
    const double conductance = step_.conductance[vessel];
    const double heat = conductance * (step_.wall_temperature[vessel] - self.temperature);
    balance_.wall_heat[vessel] = step_.h * heat;
    ByState by = self.temperature_by;
    for (double& value : by) {
      value *= -conductance;
    }
    add_energy(vessel, heat, {{vessel, by}});
  }
}

GasNetwork::Balance GasNetwork::balance(const Step& step, const std::vector<VesselGas>& gas) const {
  Assembly assembly(*this, step, gas);
  assembly.add_links();
  assembly.add_leaks();
  assembly.add_wall_heat();
  return std::move(assembly).result();
}

/// Scales of amounts and heats, by which residuals and changes are measured (2 x vessels).
Eigen::VectorXd GasNetwork::scales(const Step& step) const {
  Eigen::VectorXd scale(2 * count());
  for (int i = 0; i < count(); ++i) {
    const VesselGas& start = step.gas[i];
    const double heat = std::max(gas_.ambient_pressure * vessel(i).reference_volume / gas_constant, start.heat);
    scale[2 * i] = std::max(heat / gas_.ambient_temperature, start.amount);
    scale[2 * i + 1] = heat > 0 ? heat : 1;
  }
  return scale;
}

GasNetwork::End GasNetwork::solve(const Step& step) const {
  constexpr int most_iterations = 100;
  constexpr double rounding = 1e-14;   // fractions of amounts and heats: at which iterations end,
  constexpr double tolerance = 1e-9;   // and at which they have converged, where rounding allows no more
  constexpr double most_rounding = 1;  // and what rounding may leave of them where links are very wide
  // Factor by which a whole iteration has to reduce the residual: between flows like the square root of a difference of
  // pressures, forwards and backwards, Newton's method jumps back and forth.
  constexpr double least_gain = 0.1;
  const Eigen::VectorXd scale = scales(step);
  const auto size = [&](const Eigen::VectorXd& values) {
    return values.cwiseQuotient(scale).lpNorm<Eigen::Infinity>();
  };
  std::vector<VesselGas> gas = step.gas;
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
    double fraction = largest_share(gas, descent);
    const double rest = size(balance.rest);
    std::vector<VesselGas> next = moved_by(gas, descent, fraction);
    Balance there = this->balance(step, next);
    while (!(size(there.rest) < (1 - least_gain * fraction) * rest) && fraction * moved > rounding) {
      fraction /= 2;
      next = moved_by(gas, descent, fraction);
      there = this->balance(step, next);
    }
    if (!(size(there.rest) < rest)) {  // Rounding is all that is left.
      break;
    }
    gas = std::move(next);
    balance = std::move(there);
  }
  return end_of(std::move(balance), std::move(gas), moved <= tolerance);
}

/// Collects the solution of a step; pressures are NaN if it has not converged.
GasNetwork::End GasNetwork::end_of(Balance balance, std::vector<VesselGas> gas, bool converged) const {
  End end;
  end.converged = converged;
  end.gas = std::move(gas);
  end.flow = std::move(balance.flow);
  end.enthalpy = std::move(balance.enthalpy);
  end.leak = std::move(balance.leak);
  end.leak_enthalpy = std::move(balance.leak_enthalpy);
  end.wall_heat = std::move(balance.wall_heat);
  end.pressure.setConstant(count(), std::numeric_limits<double>::quiet_NaN());
  end.temperature = end.pressure;
  for (int i = 0; i < count() && converged; ++i) {
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
