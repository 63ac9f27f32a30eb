#include "gas/gas_network.h"

#include <Eigen/SparseLU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "gas/chamber_keys.h"
#include "geometry/key_points.h"

namespace pellicle::gas {

namespace {

void require_valid(const std::string& name, const LinkOptions& options) {
  if (options.area.has_value() == !options.flow.empty()) {
    throw Error(name + ": " + (options.area ? "both" : "neither") + " area " + (options.area ? "and" : "nor") +
                " flow given, expected one of them");
  }
  require_key_points(
      name + ".opens", options.opens, [](double share) { return share >= 0 && share <= 1; },
      "at least 0 and at most 1");
  require_key_points(
      name + ".flow", options.flow, [](double flow) { return flow >= 0; }, "at least 0");
}

/// Derivatives by one vessel's amount, heat and volume, in this order.
using ByState = Eigen::Array3d;

/// Amounts and heats, vessel after vessel.
Eigen::VectorXd values_of(const std::vector<VesselGas>& gas) {
  Eigen::VectorXd values(2 * gas.size());
  for (std::size_t v = 0; v < gas.size(); ++v) {
    values.segment<2>(2 * v) << gas[v].amount, gas[v].heat;
  }
  return values;
}

/// Whether the residual of the equations is only the rounding of amounts and heats. That can be large where a wide link
/// turns a small difference of pressures into a large flow.
bool is_rounding(const Eigen::VectorXd& rest, const Eigen::SparseMatrix<double>& jacobian, const Eigen::VectorXd& gas) {
  constexpr double fraction = 4 * std::numeric_limits<double>::epsilon();
  const Eigen::VectorXd rounding = fraction * (jacobian.cwiseAbs() * gas.cwiseAbs());
  return (rest.array().abs() <= rounding.array()).all();
}

/// Largest share, at most 1, of a descent of amounts and heats that leaves each vessel a tenth of its gas.
double largest_share(const Eigen::VectorXd& gas, const Eigen::VectorXd& descent) {
  constexpr double most_lost = 0.9;
  double fraction = 1;
  for (Eigen::Index k = 0; k < descent.size(); ++k) {
    fraction = std::min(fraction, most_lost * gas[k] / std::max(descent[k], 1e-300));
  }
  return fraction;
}

}  // namespace

/// The balances of amount and energy of all vessels in a step, added up term by term.
class GasNetwork::Balance {
 public:
  /// Pressure and temperature of a vessel, and their derivatives.
  struct Local {
    double pressure = 0;
    double temperature = 0;
    ByState pressure_by = ByState::Zero();
    ByState temperature_by = ByState::Zero();
  };

  /// @param gas amounts and heats, vessel after vessel
  Balance(const GasNetwork& network, const Step& step, const Eigen::VectorXd& gas);

  Eigen::VectorXd rest;                        ///< residual of the equations, amounts and heats vessel after vessel
  std::vector<Eigen::Triplet<double>> by_gas;  ///< its derivatives by amounts and heats
  std::vector<Eigen::Triplet<double>> by_volume;
  std::vector<Local> local;
  End end;  ///< flows through links and leaks, and heat of the walls; the rest is not set

 private:
  /// A flow between two ends, its temperature upstream, and their derivatives by the states of the ends.
  struct Flow {
    double flow = 0;  ///< [mol/s]
    double temperature = 0;
    std::array<ByState, 2> by{ByState::Zero(), ByState::Zero()};
    std::array<ByState, 2> temperature_by{ByState::Zero(), ByState::Zero()};
  };
  /// The derivatives of a quantity by the states of some vessels.
  using Derivatives = std::vector<std::pair<int, ByState>>;

  static Local state_of(const Vessel& vessel, const VesselGas& gas, double volume, double temperature);
  Flow through_orifice(double area, double gamma, const Local& from, const Local& to) const;
  Flow through_link(const Link& link) const;
  void add_derivatives(int row, double factor, int of, const ByState& by);
  void add_energy(int of, double energy, const Derivatives& by);
  void add_flow(const std::array<int, 2>& ends, const Flow& flow, double& amount, double& enthalpy);
  void add_leak(const Leak& leak);
  const Local& local_of(int number) const { return number == ambient ? outside_ : local[number]; }

  const GasNetwork* network_;
  const Step* step_;
  Local outside_;
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

GasNetwork::Balance::Balance(const GasNetwork& network, const Step& step, const Eigen::VectorXd& gas)
    : rest(2 * network.count()),
      network_(&network),
      step_(&step),
      outside_{network.gas_.ambient_pressure, network.gas_.ambient_temperature} {
  end.flow.setZero(static_cast<Eigen::Index>(network.links_.size()));
  end.enthalpy = end.flow;
  end.leak.setZero(network.count());
  end.leak_enthalpy = end.leak;
  end.wall_heat = end.leak;
  for (int vessel = 0; vessel < network.count(); ++vessel) {  // the change since the beginning of the step
    const Vessel& self = network.vessel(vessel);
    const VesselGas present{gas[2 * vessel], gas[2 * vessel + 1]};
    local.push_back(state_of(self, present, step.volume[vessel], step.temperature[vessel]));
    rest[2 * vessel] = present.amount - step.gas[vessel].amount;
    rest[2 * vessel + 1] = self.keeps_temperature ? 0 : present.heat - step.gas[vessel].heat;
    by_gas.emplace_back(2 * vessel, 2 * vessel, 1);
    by_gas.emplace_back(2 * vessel + 1, 2 * vessel + 1, 1);
  }
  for (Eigen::Index l = 0; l < end.flow.size(); ++l) {
    const Link& link = network.links_[l];
    add_flow({link.from, link.to}, through_link(link), end.flow[l], end.enthalpy[l]);
  }
  for (const Leak& leak : step.leaks) {
    add_leak(leak);
  }
  for (int vessel = 0; vessel < step.conductance.size(); ++vessel) {
    const double conductance = step.conductance[vessel];
    const double heat = conductance * (step.wall_temperature[vessel] - local[vessel].temperature);
    end.wall_heat[vessel] = step.h * heat;
    add_energy(vessel, heat, {{vessel, -conductance * local[vessel].temperature_by}});
  }
}

/// The state of a vessel with a given gas and volume. @param temperature of a vessel that keeps it [K]
GasNetwork::Balance::Local GasNetwork::Balance::state_of(const Vessel& vessel, const VesselGas& gas, double volume,
                                                         double temperature) {
  Local local;
  if (vessel.keeps_temperature) {
    local.temperature = temperature;
    local.pressure = gas.amount * gas_constant * local.temperature / volume;
    local.pressure_by = ByState(gas_constant * local.temperature / volume, 0, -local.pressure / volume);
    return local;
  }
  const double compression = std::pow(volume / vessel.reference_volume, vessel.gamma - 1);
  const double fraction = gas_constant / (compression * volume);
  local.pressure = gas.heat * fraction;
  local.pressure_by = ByState(0, fraction, -vessel.gamma * local.pressure / volume);
  local.temperature = gas.heat / (gas.amount * compression);
  local.temperature_by = ByState(-local.temperature / gas.amount, 1 / (gas.amount * compression),
                                 -(vessel.gamma - 1) * local.temperature / volume);
  return local;
}

/// An ideal gas that flows through an orifice without friction or heat, up to the speed of sound (Saint-Venant and
/// Wantzel 1839): with r the ratio of the pressures, M the molar mass and g = gamma,
///
///     flow = A p / sqrt(M R T) sqrt(2 g/(g - 1) (r^(2/g) - r^((g + 1)/g))),
///
/// where r is not less than (2/(g + 1))^(g/(g - 1)), at which the flow is choked. Within a millionth of r = 1 it is in
/// proportion to the difference of the pressures, so that its derivatives are finite everywhere.
/// @param area of the orifice times the discharge coefficient [m^2] @param gamma ratio of the heat capacities
GasNetwork::Balance::Flow GasNetwork::Balance::through_orifice(double area, double gamma, const Local& from,
                                                               const Local& to) const {
  const bool is_forward = from.pressure >= to.pressure;
  const Local& up = is_forward ? from : to;
  const Local& down = is_forward ? to : from;
  double flow = 0;            // [mol/s]
  double by_upstream = 0;     // by the pressure upstream [mol/(s Pa)]
  double by_downstream = 0;   // by the pressure downstream, 0 where the flow is choked [mol/(s Pa)]
  double by_temperature = 0;  // by the temperature upstream [mol/(s K)]
  if (up.pressure > 0) {
    constexpr double least_drop = 1e-6;  // 1 - r, below which the flow is in proportion to it
    const double drop = std::min((up.pressure - down.pressure) / up.pressure, 1.0);
    const double choked = gamma / (gamma - 1) * std::log(2 / (gamma + 1));
    const double log_ratio = std::max(std::log1p(-std::max(drop, least_drop)), choked);
    // f(r) = sqrt(2 g/(g - 1) r^(2/g) (1 - r^((g - 1)/g))) and r df/dr.
    const double lost = -std::expm1((gamma - 1) / gamma * log_ratio);
    double shape = std::sqrt(2 * gamma / (gamma - 1) * std::exp(2 / gamma * log_ratio) * lost);
    double slope = shape * (1 / gamma - (gamma - 1) / (2 * gamma) * (1 - lost) / lost);
    if (log_ratio == choked) {
      slope = 0;
    } else if (drop < least_drop) {
      slope = -shape / least_drop * (1 - drop);
      shape *= drop / least_drop;
    }
    const double scale = area / std::sqrt(network_->gas_.molar_mass * gas_constant * up.temperature);
    flow = scale * up.pressure * shape;
    by_upstream = scale * (shape - slope);
    by_downstream = down.pressure > 0 ? scale * slope * up.pressure / down.pressure : 0;
    by_temperature = -flow / (2 * up.temperature);
  }
  const std::size_t upstream = is_forward ? 0 : 1;
  const double sign = is_forward ? 1 : -1;
  Flow result;
  result.flow = sign * flow;
  result.temperature = up.temperature;
  result.temperature_by[upstream] = up.temperature_by;
  result.by[upstream] = sign * (by_upstream * up.pressure_by + by_temperature * up.temperature_by);
  result.by[1 - upstream] = sign * by_downstream * down.pressure_by;
  return result;
}

void GasNetwork::Balance::add_derivatives(int row, double factor, int of, const ByState& by) {
  if (of != ambient) {
    by_gas.emplace_back(row, 2 * of, factor * by[0]);
    by_gas.emplace_back(row, 2 * of + 1, factor * by[1]);
    by_volume.emplace_back(row, of, factor * by[2]);
  }
}

/// Adds a flow of energy [J/s] and its derivatives to the energy balance of a vessel.
void GasNetwork::Balance::add_energy(int of, double energy, const Derivatives& by) {
  const Vessel& vessel = network_->vessel(of);
  if (vessel.keeps_temperature) {
    return;
  }
  const double middle = std::sqrt(step_->start_volume[of] * step_->volume[of]);
  const double compression = std::pow(middle / vessel.reference_volume, vessel.gamma - 1);
  const double capacity = gas_constant / (vessel.gamma - 1);  // c_v
  const double factor = -step_->h * compression / capacity;
  rest[2 * of + 1] += factor * energy;
  for (const auto& [other, derivatives] : by) {
    add_derivatives(2 * of + 1, factor, other, derivatives);
  }
  add_derivatives(2 * of + 1, factor * energy, of, ByState(0, 0, (vessel.gamma - 1) / (2 * step_->volume[of])));
}

/// Adds a flow to the mass balances of the vessels at its ends, and its enthalpy to their energy balances.
/// @param ends where it comes from, and where it goes
/// @param amount set to the flow in the step [mol] @param enthalpy set to the carried enthalpy [J]
void GasNetwork::Balance::add_flow(const std::array<int, 2>& ends, const Flow& flow, double& amount, double& enthalpy) {
  const double gamma = network_->vessel(ends[0] != ambient ? ends[0] : ends[1]).gamma;
  const double capacity = gas_constant * gamma / (gamma - 1);  // c_p
  amount = step_->h * flow.flow;
  enthalpy = amount * capacity * flow.temperature;
  for (const auto& [into, sign] : {std::pair(ends[0], -1.0), std::pair(ends[1], 1.0)}) {
    if (into == ambient) {
      continue;
    }
    Derivatives energy_by;
    for (std::size_t k = 0; k < 2; ++k) {
      add_derivatives(2 * into, -sign * step_->h, ends[k], flow.by[k]);
      energy_by.emplace_back(ends[k],
                             sign * capacity * (flow.temperature * flow.by[k] + flow.flow * flow.temperature_by[k]));
    }
    rest[2 * into] -= sign * amount;
    add_energy(into, sign * flow.flow * capacity * flow.temperature, energy_by);
  }
}

/// The flow of a link: through its orifice, or that of its pump.
GasNetwork::Balance::Flow GasNetwork::Balance::through_link(const Link& link) const {
  const LinkOptions& options = link.options;
  if (options.area) {
    const double open = options.opens.empty() ? 1 : value_on_key_points(options.opens, step_->time);
    const double gamma = network_->vessel(link.from != ambient ? link.from : link.to).gamma;
    const double area = *options.area * options.discharge * open;
    const Flow flow = through_orifice(area, gamma, local_of(link.from), local_of(link.to));
    return options.one_way && flow.flow < 0 ? Flow() : flow;
  }
  Flow flow;
  flow.flow = value_on_key_points(options.flow, step_->time);
  flow.temperature = local_of(link.from).temperature;
  flow.temperature_by[0] = local_of(link.from).temperature_by;
  if (link.from == ambient && options.temperature) {
    flow.temperature = *options.temperature;
  }
  return flow;
}

void GasNetwork::Balance::add_leak(const Leak& leak) {
  Local there = local_of(leak.vessel);
  there.pressure += leak.rise;
  const double gamma = network_->vessel(leak.vessel).gamma;
  const Flow flow = through_orifice(leak.area, gamma, there, local_of(leak.outside));
  double amount = 0;
  double enthalpy = 0;
  add_flow({leak.vessel, leak.outside}, flow, amount, enthalpy);
  for (const auto& [of, sign] : {std::pair(leak.vessel, 1.0), std::pair(leak.outside, -1.0)}) {
    if (of != ambient) {
      end.leak[of] += sign * amount;
      end.leak_enthalpy[of] += sign * enthalpy;
    }
  }
}

GasNetwork::End GasNetwork::solve(const Step& step) const {
  constexpr int most_iterations = 100;
  constexpr double rounding = 1e-14;   // fractions of amounts and heats: at which iterations end,
  constexpr double tolerance = 1e-9;   // and at which they have converged, where rounding allows no more
  constexpr double most_rounding = 1;  // and what rounding may leave of them where links are very wide
  // Factor by which a whole iteration has to reduce the residual: between flows like the square root of a difference of
  // pressures, forwards and backwards, Newton's method jumps back and forth.
  constexpr double least_gain = 0.1;
  Eigen::VectorXd scale(2 * count());  // of amounts and heats, by which residuals and changes are measured
  for (int i = 0; i < count(); ++i) {
    const VesselGas& start = step.gas[i];
    const double heat = std::max(gas_.ambient_pressure * vessel(i).reference_volume / gas_constant, start.heat);
    scale[2 * i] = std::max(heat / gas_.ambient_temperature, start.amount);
    scale[2 * i + 1] = heat > 0 ? heat : 1;
  }
  const auto size = [&](const Eigen::VectorXd& values) {
    return values.cwiseQuotient(scale).lpNorm<Eigen::Infinity>();
  };
  Eigen::VectorXd gas = values_of(step.gas);
  Balance balance(*this, step, gas);
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
    Eigen::VectorXd next = gas - fraction * descent;
    Balance there(*this, step, next);
    while (!(size(there.rest) < (1 - least_gain * fraction) * rest) && fraction * moved > rounding) {
      fraction /= 2;
      next = gas - fraction * descent;
      there = Balance(*this, step, next);
    }
    if (!(size(there.rest) < rest)) {  // Rounding is all that is left.
      break;
    }
    gas = std::move(next);
    balance = std::move(there);
  }
  End end = std::move(balance.end);
  end.converged = moved <= tolerance;
  end.pressure.setConstant(count(), std::numeric_limits<double>::quiet_NaN());
  end.temperature = end.pressure;
  for (int i = 0; i < count(); ++i) {
    end.gas.push_back({gas[2 * i], gas[2 * i + 1]});
    if (end.converged) {
      end.pressure[i] = balance.local[i].pressure;
      end.temperature[i] = balance.local[i].temperature;
    }
  }
  return end;
}

Eigen::MatrixXd GasNetwork::slopes(const Step& step, const End& end) const {
  const Balance balance(*this, step, values_of(end.gas));
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

}  // namespace pellicle::gas
