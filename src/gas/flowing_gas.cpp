#include "gas/flowing_gas.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/error.h"
#include "base/units.h"

namespace pellicle::gas {

namespace {

/// W of a chamber that is not joined, at the end of a step in which its pressure moves its wall [m^3].
double moved_wall(const Chambers& chambers, const GasExchange& exchange, int chamber, double volume, double compliance,
                  double time) {
  if (chambers.prescribes_volume(chamber)) {
    return chambers.prescribed_volume(chamber, time);
  }
  if (!chambers.needs_volume(chamber)) {
    return volume + compliance * chambers.state(exchange, chamber, volume, time).pressure;
  }
  // V - volume - compliance p(V) rises and is concave: Newton's method goes up to its zero, once it is below.
  GasState gas = chambers.state(exchange, chamber, volume > 0 ? volume : chambers.initial_volume(chamber), time);
  constexpr int most_iterations = 200;
  constexpr double tolerance = 1e-14;
  for (int iteration = 0; iteration < most_iterations; ++iteration) {
    const double excess = gas.volume - volume - compliance * gas.pressure;
    const double step = -excess / (1 - compliance * gas.pressure_slope);
    if (std::abs(step) <= tolerance * gas.volume) {
      break;
    }
    gas = chambers.state(exchange, chamber, std::max(gas.volume + step, gas.volume / 2), time);
  }
  return gas.volume;
}

/// @throws Error where gas would flow between objects whose air or gas differs
void require_alike(const FlowingGas::Object& first, const FlowingGas::Object& other) {
  const GasOptions& a = first.chambers->gas_options();
  const GasOptions& b = other.chambers->gas_options();
  for (const auto& [key, value] : {std::pair("gas.ambient_pressure", &GasOptions::ambient_pressure),
                                   std::pair("gas.ambient_temperature", &GasOptions::ambient_temperature),
                                   std::pair("gas.molar_mass", &GasOptions::molar_mass)}) {
    if (a.*value != b.*value) {
      throw Error(other.name + ": " + key + ": " + number_text(b.*value) + ", expected " + number_text(a.*value) +
                  " as of " + first.name + ", to whose chambers its own are linked");
    }
  }
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
    for (const Chambers::Link& other : chambers(object).links()) {
      if (objects_[object].name == of_object && other.name == link) {
        return vessels_[object].number(other.from == Chambers::elsewhere ? other.to : other.from);
      }
    }
  }
  return GasNetwork::ambient;
}

void FlowingGas::make_network() {
  vessels_.clear();
  inside_.clear();
  std::vector<GasNetwork::Vessel> vessels;
  for (std::size_t object = 0; object < objects(); ++object) {
    inside_.push_back(exchange(object).inside);
    vessels_.push_back(chambers(object).vessels(exchange(object), static_cast<int>(vessels.size())));
    for (const int chamber : vessels_.back().chambers) {
      vessels.push_back(chambers(object).vessel(chamber));
    }
  }
  network_ = GasNetwork(std::move(vessels), network_links(), chambers(0).gas_options());
  within_.clear();
  beyond_.clear();
  for (std::size_t object = 0; object < objects(); ++object) {
    for (const int chamber : chambers(object).joined()) {
      const int outside = vessels_[object].number(exchange(object).gas_outside(chamber));
      within_.push_back(vessels_[object].number(chamber));
      beyond_.push_back(outside < 0 ? network_.count() : outside);
    }
  }
}

/// The links of all objects, each once; sets link_of_.
std::vector<GasNetwork::Link> FlowingGas::network_links() {
  std::vector<GasNetwork::Link> links;
  link_of_.assign(objects(), {});
  for (std::size_t object = 0; object < objects(); ++object) {
    for (const Chambers::Link& link : chambers(object).links()) {
      const auto end_of = [&](int end, const std::string& name) {
        return end == Chambers::elsewhere ? end_elsewhere(name, link.name) : vessels_[object].number(end);
      };
      const int from = end_of(link.from, link.options.from);
      const int to = end_of(link.to, link.options.to);
      const bool may_be_there = link.from == Chambers::elsewhere || link.to == Chambers::elsewhere;  // of the other one
      const auto same = std::find_if(links.begin(), links.end(), [&](const GasNetwork::Link& other) {
        return may_be_there && other.name == link.name && other.from == from && other.to == to;
      });
      int number = static_cast<int>(same - links.begin());
      if (same == links.end() && (from != to || link.from == link.to)) {  // What is amiss the network says.
        links.push_back({link.name, from, to, link.options});
      } else if (same == links.end()) {
        number = -1;
      }
      link_of_[object].push_back(number);
    }
  }
  return links;
}

void FlowingGas::begin_step() {
  for (std::size_t object = 0; object < objects(); ++object) {
    if (inside_[object] != exchange(object).inside) {
      make_network();
      return;
    }
  }
}

GasNetwork::Step FlowingGas::network_step(const Walls& walls, double time) const {
  GasNetwork::Step step;
  step.time = time;
  step.h = objects_[0].step->h;
  for (std::size_t object = 0; object < objects(); ++object) {
    chambers(object).add_to_step(step, *objects_[object].step, vessels_[object], walls[object], time);
  }
  return step;
}

GasNetwork::End FlowingGas::solve(const GasNetwork::Step& step) const {
  GasNetwork::End end;
  end.converged = network_.count() == 0;
  return end.converged || !(step.volume.minCoeff() > 0) ? end : network_.solve(step);
}

std::vector<GasState> FlowingGas::end_states(std::size_t object, const Walls& walls, double time,
                                             const GasNetwork::End& end) const {
  const Chambers& own = chambers(object);
  std::vector<GasState> states = own.states_against_ambient(exchange(object), walls[object], time);
  for (const int chamber : vessels_[object].chambers) {
    const int number = vessels_[object].number(chamber);
    GasState& gas = states[chamber];
    if (!end.converged) {
      gas.pressure = std::numeric_limits<double>::quiet_NaN();
      continue;
    }
    gas.absolute_pressure = end.pressure[number];
    gas.pressure = exchange(object).is_open(chamber) ? 0 : end.pressure[number] - own.gas_options().ambient_pressure;
    gas.amount = end.gas[number].amount;
    gas.temperature = end.temperature[number];
  }
  Chambers::put_across_walls(exchange(object), states);
  return states;
}

Eigen::MatrixXd FlowingGas::slopes(const GasNetwork::Step& step, const GasNetwork::End& end) const {
  // With a row and a column of zeros for the ambient air; open chambers have zeros, too.
  const int count = network_.count();
  Eigen::MatrixXd of_vessels = Eigen::MatrixXd::Zero(count + 1, count + 1);
  of_vessels.topLeftCorner(count, count) = network_.slopes(step, end);
  for (std::size_t object = 0; object < objects(); ++object) {
    for (const int chamber : vessels_[object].chambers) {
      if (exchange(object).is_open(chamber)) {
        of_vessels.row(vessels_[object].number(chamber)).setZero();
        of_vessels.col(vessels_[object].number(chamber)).setZero();
      }
    }
  }
  // Pressure across a wall: inside less outside; W adds to the volume inside and reduces that outside.
  const Eigen::MatrixXd of_walls = of_vessels(Eigen::all, within_) - of_vessels(Eigen::all, beyond_);
  return of_walls(within_, Eigen::all) - of_walls(beyond_, Eigen::all);
}

GasExchange FlowingGas::end_step(std::size_t object, const Walls& walls, const Walls& caps,
                                 const GasNetwork::Step& step, const GasNetwork::End& end) const {
  return chambers(object).end_step(*objects_[object].step, vessels_[object], link_of_[object], walls[object],
                                   caps[object], step.time, end);
}

FlowingGas::Walls FlowingGas::moved_walls(Walls walls, const std::vector<Response>& responses, double time) const {
  std::vector<MovedWall> moved;
  int number = 0;
  for (std::size_t object = 0; object < objects(); ++object) {
    const Chambers& own = chambers(object);
    const auto& [free, compliance] = responses[object];
    if (compliance.size() == 0) {
      number += static_cast<int>(own.joined().size());
      continue;
    }
    // First guess: as if no chamber were joined; of chambers inside others, and of those round them, W at the
    // beginning.
    std::vector<bool> is_nested(own.count());
    for (int chamber = 0; chamber < own.count(); ++chamber) {
      if (const int outside = exchange(object).gas_outside(chamber); outside >= 0) {
        is_nested[chamber] = true;
        is_nested[outside] = true;
      }
    }
    walls[object] = exchange(object).within_walls(exchange(object).volume);
    for (int chamber = 0; chamber < own.count(); ++chamber) {
      if (!is_nested[chamber]) {
        walls[object][chamber] = moved_wall(own, exchange(object), chamber, free[chamber], compliance[chamber], time);
      }
    }
    for (const int chamber : own.joined()) {
      moved.push_back({object, chamber, number++, free[chamber], compliance[chamber]});
    }
  }
  if (!moved.empty()) {
    balance_walls(walls, moved, time);
  }
  return walls;
}

/// Solves W - `walls` - `compliance` q = 0 by Newton's method for the joined chambers whose walls respond to pressures.
void FlowingGas::balance_walls(Walls& walls, const std::vector<MovedWall>& moved, double time) const {
  const auto count = static_cast<Eigen::Index>(moved.size());
  std::vector<Eigen::Index> numbers;
  Eigen::VectorXd compliance(count);
  for (const MovedWall& wall : moved) {
    compliance[static_cast<Eigen::Index>(numbers.size())] = wall.compliance;
    numbers.push_back(wall.number);
  }
  constexpr int most_iterations = 50;
  constexpr double tolerance = 1e-12;
  for (int iteration = 0; iteration < most_iterations; ++iteration) {
    const GasNetwork::Step step = network_step(walls, time);
    const GasNetwork::End end = solve(step);
    std::vector<std::vector<GasState>> states(objects());
    Eigen::VectorXd residual(count);
    bool is_far = false;
    for (Eigen::Index k = 0; k < count; ++k) {
      const MovedWall& wall = moved[k];
      if (states[wall.object].empty()) {
        states[wall.object] = end_states(wall.object, walls, time, end);
      }
      const double present = walls[wall.object][wall.chamber];
      residual[k] = present - wall.unpressed - wall.compliance * states[wall.object][wall.chamber].pressure;
      is_far = is_far || std::abs(residual[k] / present) > tolerance;
    }
    if (!end.converged || !is_far) {
      break;
    }
    const Eigen::MatrixXd derivative =
        Eigen::MatrixXd::Identity(count, count) - compliance.asDiagonal() * slopes(step, end)(numbers, numbers);
    const Eigen::VectorXd change = derivative.partialPivLu().solve(residual);
    for (Eigen::Index k = 0; k < count; ++k) {
      double& wall = walls[moved[k].object][moved[k].chamber];
      wall = std::max(wall - change[k], wall / 2);
    }
  }
}

}  // namespace pellicle::gas
