#include "gas/flowing_gas.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/error.h"
#include "base/units.h"

namespace pellicle {
inline namespace gas {

namespace {

/// W of a chamber that nothing is joined to, at the end of a step in which its pressure moves its wall.
double moved_wall(const Chambers& chambers, int chamber, double volume, double compliance, double time) {
  if (chambers.prescribes_volume(chamber)) {
    return chambers.prescribed_volume(chamber, time);
  }
  if (!chambers.needs_volume(chamber)) {
    return volume + compliance * chambers.state(chamber, volume, time).pressure;
  }
  // V - volume - compliance p(V) rises and is concave: Newton's method goes up to its zero, once it is below.
  GasState gas = chambers.state(chamber, volume > 0 ? volume : chambers.initial_volume(chamber), time);
  constexpr int most_iterations = 200;
  constexpr double tolerance = 1e-14;
  for (int iteration = 0; iteration < most_iterations; ++iteration) {
    const double excess = gas.volume - volume - compliance * gas.pressure;
    const double step = -excess / (1 - compliance * gas.pressure_slope);
    if (std::abs(step) <= tolerance * gas.volume) {
      break;
    }
    gas = chambers.state(chamber, std::max(gas.volume + step, gas.volume / 2), time);
  }
  return gas.volume;
}

/// @throws Error where gas would flow between objects whose air or gas differs
void require_alike(const FlowingGas::Object& first, const FlowingGas::Object& other) {
  const GasOptions& a = first.chambers->gas_options();
  const GasOptions& b = other.chambers->gas_options();
  const auto require = [&](const std::string& key, double of_first, double of_other) {
    if (of_first != of_other) {
      throw Error(other.name + ": " + key + ": " + number_text(of_other) + ", expected " + number_text(of_first) +
                  " as of " + first.name + ", to whose chambers its own are linked");
    }
  };
  require("gas.ambient_pressure", a.ambient_pressure, b.ambient_pressure);
  require("gas.ambient_temperature", a.ambient_temperature, b.ambient_temperature);
  require("gas.molar_mass", a.molar_mass, b.molar_mass);
}

}  // namespace

FlowingGas::FlowingGas(std::vector<Object> objects) : objects_(std::move(objects)) {
  for (const Object& object : objects_) {
    require_alike(objects_.front(), object);
  }
  make_network();
}

/// Number of the vessel at the end of a link that is in an object for which another link gives only its name.
/// @param name OBJECT.CHAMBER
int FlowingGas::end_elsewhere(const std::string& name, const std::string& link) const {
  const std::string of_object = name.substr(0, name.find('.'));
  for (std::size_t object = 0; object < objects(); ++object) {
    if (objects_[object].name != of_object) {
      continue;
    }
    for (const Chambers::Link& other : chambers(object).links()) {
      if (other.name == link) {
        const int end = other.from == Chambers::elsewhere ? other.to : other.from;
        return first_vessel_[object] + chambers(object).vessel_of(end);
      }
    }
  }
  return GasNetwork::ambient;
}

void FlowingGas::make_network() {
  first_vessel_ = {0};
  inside_.clear();
  std::vector<GasNetwork::Vessel> vessels;
  for (std::size_t object = 0; object < objects(); ++object) {
    const Chambers& own = chambers(object);
    for (std::size_t vessel = 0; vessel < own.vessels().size(); ++vessel) {
      vessels.push_back(own.vessel(static_cast<int>(vessel)));
    }
    first_vessel_.push_back(static_cast<int>(vessels.size()));
    Eigen::VectorXd inside(own.count());
    for (int chamber = 0; chamber < own.count(); ++chamber) {
      inside[chamber] = own.inside(chamber);
    }
    inside_.push_back(std::move(inside));
  }
  std::vector<GasNetwork::Link> links;
  link_of_.assign(objects(), {});
  for (std::size_t object = 0; object < objects(); ++object) {
    for (const Chambers::Link& link : chambers(object).links()) {
      const auto end_of = [&](int end, const std::string& name) {
        return end == Chambers::elsewhere ? end_elsewhere(name, link.name)
               : end < 0                  ? GasNetwork::ambient
                                          : first_vessel_[object] + chambers(object).vessel_of(end);
      };
      const int from = end_of(link.from, link.options.from);
      const int to = end_of(link.to, link.options.to);
      int number = -1;
      if (link.from == Chambers::elsewhere || link.to == Chambers::elsewhere) {  // The other object may have had it.
        const auto same = std::find_if(links.begin(), links.end(), [&](const GasNetwork::Link& other) {
          return other.name == link.name && other.from == from && other.to == to;
        });
        number = same != links.end() ? static_cast<int>(same - links.begin()) : -1;
      }
      const bool leads_somewhere = from != to || link.from == link.to;  // What is amiss the network says.
      if (number < 0 && leads_somewhere) {
        number = static_cast<int>(links.size());
        links.push_back({link.name, from, to, link.options});
      }
      link_of_[object].push_back(number);
    }
  }
  network_ = GasNetwork(std::move(vessels), std::move(links), chambers(0).gas_options());
  sides_of_walls_.clear();
  for (std::size_t object = 0; object < objects(); ++object) {
    const int first = first_vessel_[object];
    for (const int chamber : chambers(object).joined()) {
      const int outside = chambers(object).vessel_outside(chamber);
      sides_of_walls_.push_back({first + chambers(object).vessel_of(chamber), outside < 0 ? -1 : first + outside});
    }
  }
}

void FlowingGas::begin_step() {
  bool is_same = true;
  for (std::size_t object = 0; object < objects(); ++object) {
    for (int chamber = 0; chamber < chambers(object).count(); ++chamber) {
      is_same = is_same && inside_[object][chamber] == chambers(object).inside(chamber);
    }
  }
  if (!is_same) {
    make_network();
  }
}

GasNetwork::Step FlowingGas::network_step(const Walls& walls, double time) const {
  GasNetwork::Step all = chambers(0).network_step(walls[0], time);
  const auto append = [](Eigen::VectorXd& values, const Eigen::VectorXd& others) {
    values.conservativeResize(values.size() + others.size());
    values.tail(others.size()) = others;
  };
  const auto fill_in = [](Eigen::VectorXd& values, std::size_t size) {
    if (values.size() == 0) {
      values.setZero(static_cast<Eigen::Index>(size));
    }
  };
  for (std::size_t object = 1; object < objects(); ++object) {
    GasNetwork::Step own = chambers(object).network_step(walls[object], time);
    const int first = first_vessel_[object];
    for (GasNetwork::Leak leak : own.leaks) {
      leak.vessel += first;
      leak.outside += leak.outside < 0 ? 0 : first;
      all.leaks.push_back(leak);
    }
    if (all.conductance.size() + own.conductance.size() > 0) {
      for (Eigen::VectorXd* values : {&all.conductance, &all.wall_temperature}) {
        fill_in(*values, all.gas.size());
      }
      for (Eigen::VectorXd* values : {&own.conductance, &own.wall_temperature}) {
        fill_in(*values, own.gas.size());
      }
      append(all.conductance, own.conductance);
      append(all.wall_temperature, own.wall_temperature);
    }
    append(all.volume, own.volume);
    append(all.start_volume, own.start_volume);
    append(all.temperature, own.temperature);
    all.gas.insert(all.gas.end(), own.gas.begin(), own.gas.end());
  }
  return all;
}

GasNetwork::End FlowingGas::solve(const GasNetwork::Step& step) const {
  if (network_.count() == 0) {
    return {};
  }
  if (!(step.volume.minCoeff() > 0)) {
    GasNetwork::End end;
    end.converged = false;
    return end;
  }
  return network_.solve(step);
}

std::vector<GasState> FlowingGas::end_states(std::size_t object, const Walls& walls, double time,
                                             const GasNetwork::End& end) const {
  const Chambers& own = chambers(object);
  const Eigen::VectorXd volumes = own.gas_volumes(walls[object]);
  std::vector<GasState> states(own.count());
  for (int chamber = 0; chamber < own.count(); ++chamber) {
    if (own.inside(chamber) == chamber) {
      states[chamber] = own.state(chamber, volumes[chamber], time);
    }
  }
  for (std::size_t v = 0; v < own.vessels().size(); ++v) {
    const int chamber = own.vessels()[v];
    const int vessel = first_vessel_[object] + static_cast<int>(v);
    GasState& gas = states[chamber];
    if (!end.converged) {
      gas.pressure = std::numeric_limits<double>::quiet_NaN();
      continue;
    }
    gas.absolute_pressure = end.pressure[vessel];
    gas.pressure = own.is_open(chamber) ? 0 : end.pressure[vessel] - own.gas_options().ambient_pressure;
    gas.amount = end.gas[vessel].amount;
    gas.temperature = end.temperature[vessel];
  }
  own.put_across_walls(states);
  return states;
}

Eigen::MatrixXd FlowingGas::slopes(const GasNetwork::Step& step, const GasNetwork::End& end) const {
  Eigen::MatrixXd of_vessels = network_.slopes(step, end);
  for (std::size_t object = 0; object < objects(); ++object) {
    for (std::size_t v = 0; v < chambers(object).vessels().size(); ++v) {
      if (chambers(object).is_open(chambers(object).vessels()[v])) {
        of_vessels.row(first_vessel_[object] + static_cast<int>(v)).setZero();
        of_vessels.col(first_vessel_[object] + static_cast<int>(v)).setZero();
      }
    }
  }
  // The pressure across a wall is that inside less that outside, and its W counts in the volumes likewise.
  const auto walls = static_cast<Eigen::Index>(sides_of_walls_.size());
  Eigen::MatrixXd of_walls(of_vessels.rows(), walls);
  Eigen::MatrixXd result(walls, walls);
  const auto row = [](const Eigen::MatrixXd& of, int vessel) -> Eigen::RowVectorXd {
    return vessel < 0 ? Eigen::RowVectorXd::Zero(of.cols()).eval() : of.row(vessel).eval();
  };
  for (Eigen::Index wall = 0; wall < walls; ++wall) {
    const auto& [inside, outside] = sides_of_walls_[wall];
    of_walls.col(wall) = of_vessels.col(inside);
    if (outside >= 0) {
      of_walls.col(wall) -= of_vessels.col(outside);
    }
  }
  for (Eigen::Index wall = 0; wall < walls; ++wall) {
    const auto& [inside, outside] = sides_of_walls_[wall];
    result.row(wall) = row(of_walls, inside) - row(of_walls, outside);
  }
  return result;
}

GasNetwork::Step FlowingGas::own_step(std::size_t object, const GasNetwork::Step& step) const {
  GasNetwork::Step own;
  own.gas.assign(step.gas.begin() + first_vessel_[object], step.gas.begin() + first_vessel_[object + 1]);
  own.time = step.time;
  return own;
}

GasNetwork::End FlowingGas::own_end(std::size_t object, const GasNetwork::End& end) const {
  const int first = first_vessel_[object];
  const int count = first_vessel_[object + 1] - first;
  GasNetwork::End own;
  own.converged = end.converged;
  own.gas.assign(end.gas.begin() + first, end.gas.begin() + first + count);
  own.pressure = end.pressure.segment(first, count);
  own.temperature = end.temperature.segment(first, count);
  own.leak = end.leak.segment(first, count);
  own.leak_enthalpy = end.leak_enthalpy.segment(first, count);
  own.wall_heat = end.wall_heat.segment(first, count);
  own.flow.setZero(static_cast<Eigen::Index>(link_of_[object].size()));
  own.enthalpy = own.flow;
  for (std::size_t link = 0; link < link_of_[object].size(); ++link) {
    if (const int number = link_of_[object][link]; number >= 0) {
      own.flow[static_cast<Eigen::Index>(link)] = end.flow[number];
      own.enthalpy[static_cast<Eigen::Index>(link)] = end.enthalpy[number];
    }
  }
  return own;
}

GasExchange FlowingGas::end_step(std::size_t object, const Walls& walls, const Walls& caps,
                                 const GasNetwork::Step& step, const GasNetwork::End& end) const {
  return chambers(object).end_step(walls[object], caps[object], own_step(object, step), own_end(object, end));
}

FlowingGas::Walls FlowingGas::moved_walls(Walls walls, const std::vector<Response>& responses, double time) const {
  struct Joined {
    std::size_t object;
    int chamber;
    Eigen::Index number;  // among the joined walls of all objects
  };
  std::vector<Joined> joined;
  Eigen::Index number = 0;
  for (std::size_t object = 0; object < objects(); ++object) {
    const Chambers& own = chambers(object);
    const Response& response = responses[object];
    if (response.compliance.size() == 0) {
      number += static_cast<Eigen::Index>(own.joined().size());
      continue;
    }
    // From where they would be if nothing were joined; those inside others and round them from where they were.
    walls[object] = own.last_volumes();
    std::vector<bool> is_nested(own.count());
    for (int chamber = 0; chamber < own.count(); ++chamber) {
      if (own.outside(chamber) >= 0) {
        is_nested[chamber] = true;
        is_nested[own.outside(chamber)] = true;
      }
    }
    for (int chamber = 0; chamber < own.count(); ++chamber) {
      if (!is_nested[chamber]) {
        walls[object][chamber] = moved_wall(own, chamber, response.walls[chamber], response.compliance[chamber], time);
      }
    }
    for (const int chamber : own.joined()) {
      joined.push_back({object, chamber, number});
      ++number;
    }
  }
  const auto count = static_cast<Eigen::Index>(joined.size());
  std::vector<Eigen::Index> numbers;
  Eigen::VectorXd compliance(count);
  for (const Joined& wall : joined) {
    compliance[static_cast<Eigen::Index>(numbers.size())] = responses[wall.object].compliance[wall.chamber];
    numbers.push_back(wall.number);
  }
  constexpr int most_iterations = 50;
  constexpr double tolerance = 1e-12;
  for (int iteration = 0; iteration < most_iterations && !joined.empty(); ++iteration) {
    const GasNetwork::Step step = network_step(walls, time);
    const GasNetwork::End end = solve(step);
    std::vector<std::vector<GasState>> states(objects());
    Eigen::VectorXd excess(count);
    bool is_far = false;
    for (Eigen::Index k = 0; k < count; ++k) {
      const auto& [object, chamber, place] = joined[k];
      if (states[object].empty()) {
        states[object] = end_states(object, walls, time, end);
      }
      excess[k] =
          walls[object][chamber] - responses[object].walls[chamber] - compliance[k] * states[object][chamber].pressure;
      is_far = is_far || std::abs(excess[k] / walls[object][chamber]) > tolerance;
    }
    if (!end.converged || !is_far) {
      break;
    }
    const Eigen::MatrixXd derivative =
        Eigen::MatrixXd::Identity(count, count) - compliance.asDiagonal() * slopes(step, end)(numbers, numbers);
    const Eigen::VectorXd change = derivative.partialPivLu().solve(excess);
    for (Eigen::Index k = 0; k < count; ++k) {
      double& wall = walls[joined[k].object][joined[k].chamber];
      wall = std::max(wall - change[k], wall / 2);
    }
  }
  return walls;
}

}  // namespace gas
}  // namespace pellicle
