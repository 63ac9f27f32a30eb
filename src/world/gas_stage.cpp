#include "world/gas_stage.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "geometry/pressure_load.h"
#include "io/console.h"
#include "parallel/collective.h"
#include "surface/split_corners.h"

namespace pellicle::world {

namespace {

/// Where the wall of a chamber is open: id of the element or vertex, place, number of the chamber.
using Opening = std::array<double, 5>;

/// The one with the least id of all ranks. Collective.
Opening first_of_all(MPI_Comm comm, const Opening& of_rank) {
  const std::vector<Opening> all = of_all_ranks(comm, std::vector{of_rank});
  return *std::min_element(all.begin(), all.end());
}

}  // namespace

GasStage::GasStage(const Surface& surface, const Options& options, State& state, const TimeIntegrator& integrator,
                   const Eigen::Vector3d& origin, const SymmetryPlanes& planes)
    : surface_(surface),
      options_(options),
      state_(state),
      integrator_(integrator),
      chambers_(surface, options.gas, options.chambers, origin, state.chamber, state.gas, planes),
      gas_step_{&exchange()},
      pushes_unevenly_(gas_pushes_unevenly(options)),
      uneven_(surface.particles, 3),
      between_(surface.particles, 3) {}

void GasStage::start() {
  if (state_.gas != nullptr) {
    *state_.gas = chambers_.first_exchange(chambers_.volumes(state_.position));
  }
}

void GasStage::update_derived() {
  if (state_.gas != nullptr) {
    chambers_.set_numbers(state_.chamber);
    gas_step_ = {state_.gas};
  }
  if (state_.burning) {
    chambers_.set_active(state_.burning->active);
  }
}

StageResult GasStage::begin(Step& step) {
  const double fraction = integrator_.fraction();
  if (state_.burning) {
    chambers_.set_active(state_.burning->active);
  }
  if (state_.gas != nullptr) {
    opened_ = opened();
    *state_.gas = chambers_.recapped(*state_.gas, chambers_.volumes(state_.position), state_.time);
  }
  if (pushes_unevenly_) {
    // As far as the forces are in balance at the beginning of the step, or on the way through it.
    between_.values() = state_.position.values();
    if (integrator_.is_second_order()) {
      between_.values() += fraction * step.h * state_.velocity.values();
    }
    uneven_.values().leftCols(surface_.particles.owned) =
        chambers_.uneven_forces(exchange(), between_, gravity_of_gas(options_), state_.time_of_loads());
    uneven_.update_ghosts();
  }
  if (state_.gas != nullptr) {
    ChamberWalls walls =
        chambers_.walls(*state_.gas, state_.position, gravity_of_gas(options_), state_.time_of_loads());
    if (state_.burning) {
      begin_wall_heat(step.h, walls);
    }
    gas_step_ = {state_.gas, walls, fraction * step.h};
  }
  return {};
}

StageResult GasStage::end(Step& step) {
  StageResult result;
  if (state_.gas == nullptr) {
    return result;
  }
  const Eigen::VectorXd wall_heat = state_.gas->wall_heat;
  *state_.gas = filled_->end_gas(state_.position);
  if (state_.burning) {
    result.reason = end_wall_heat(step.h, state_.gas->wall_heat - wall_heat);
  }
  gas_step_ = {state_.gas};
  if (result.reason.empty()) {
    result.reason = chambers_.imbalance(*state_.gas, chambers_.volumes(state_.position), state_.time + step.h);
  }
  result.converged = result.reason.empty();
  add_newly_open(opened_, state_.time + step.h, step.news);
  return result;
}

/// Finds the heat between gas and walls that have temperatures, for a step of length h [s]. A particle i with a
/// fraction a of a chamber's walls gives h k a/(1 + h k a/(c m)) (T_i - T_gas), with the heat transfer coefficient k,
/// as if its own temperature changed implicitly too; the gas receives the sum. @param walls their heat is set
void GasStage::begin_wall_heat(double h, ChamberWalls& walls) {
  const BurningFields& fields = *state_.burning;
  std::map<std::pair<PetscInt, int>, double> areas;
  for (std::size_t triangle = 0; triangle < surface_.triangles.size(); ++triangle) {
    const int wall = chambers_.of_triangle(static_cast<PetscInt>(triangle));
    if (wall < 0) {
      continue;
    }
    const auto& [a, b, c] = surface_.triangles[triangle];
    const double area =
        area_vector(state_.position.vector(a), state_.position.vector(b), state_.position.vector(c)).norm();
    for (const int side : {state_.gas->gas_inside(wall), state_.gas->gas_outside(wall)}) {
      for (const PetscInt corner : {a, b, c}) {
        if (side >= 0 && chambers_.heat_transfer(side) > 0 && corner < surface_.particles.owned &&
            fields.mass.data()[corner] > 0) {
          areas[{corner, side}] += area / 3;
        }
      }
    }
  }
  wall_shares_.clear();
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(chambers_.count(), 2);
  for (const auto& [at, area] : areas) {
    const auto [particle, chamber] = at;
    const double bare = chambers_.heat_transfer(chamber) * area;
    const double conductance = bare / (1 + h * bare / (options_.heat.capacity * fields.mass.data()[particle]));
    wall_shares_.push_back({particle, chamber, conductance});
    sums(chamber, 0) += conductance;
    sums(chamber, 1) += conductance * fields.temperature.data()[particle];
  }
  sum_over_ranks(surface_.comm(), sums);
  walls.conductance = sums.col(0);
  walls.temperature = (sums.col(0).array() > 0).select(sums.col(1).cwiseQuotient(sums.col(0)), walls.temperature);
}

/// Takes the heat that the gas has received from the particles, or gives them what it has lost.
/// @param given to the gas of each chamber in the step [J]
/// @returns in words where the two do not agree to 1e-10; empty: everywhere
std::string GasStage::end_wall_heat(double h, const Eigen::VectorXd& given) {
  BurningFields& fields = *state_.burning;
  // A row a chamber: the heat that walls and gas have received together, which should be 0, and the sum of the heat
  // that was exchanged [J].
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(given.size(), 2);
  for (const auto& [particle, chamber, conductance] : wall_shares_) {
    double& temperature = fields.temperature.data()[particle];
    const ChamberWalls& walls = gas_step_.walls;
    const double gas = walls.temperature[chamber] - given[chamber] / (h * walls.conductance[chamber]);
    const double heat = h * conductance * (gas - temperature);  // into the wall [J]
    temperature += heat / (options_.heat.capacity * fields.mass.data()[particle]);
    (heat > 0 ? fields.heat_in : fields.heat_out) += std::abs(heat);
    sums(chamber, 0) += heat;
    sums(chamber, 1) += std::abs(heat);
  }
  fields.temperature.update_ghosts();
  sum_over_ranks(surface_.comm(), sums);
  constexpr double tolerance = 1e-10;
  for (Eigen::Index chamber = 0; chamber < given.size(); ++chamber) {
    const double rest = sums(chamber, 0) + given[chamber];
    if (!(std::abs(rest) <= tolerance * (sums(chamber, 1) + std::abs(given[chamber])))) {
      return fmt::format("the ledger of the heat between chamber {} and walls is off by {:.2g} J of {:.2g} J",
                         chambers_.name(static_cast<int>(chamber)), rest, std::abs(given[chamber]));
    }
  }
  return "";
}

void GasStage::report(Report& report, const Step& /*step*/) const {
  // Several chambers: volumes and amounts add up, pressures and temperatures are means by volume.
  const Eigen::VectorXd walls = chambers_.volumes(state_.position);
  const Eigen::VectorXd volumes = exchange().gas_volumes(walls);
  std::vector<GasState> states = chambers_.states(exchange(), walls, state_.time_of_loads());
  GasState all;
  int at_first = 0;  // chambers before any was cut in two; they come first
  double initial_volume = 0;
  double energy = 0;  // of the joined chambers
  for (int chamber = 0; chamber < chambers_.count(); ++chamber) {
    GasState& gas = states[chamber];
    gas.pressure = chambers_.prescribes_volume(chamber) ? state_.pressure[chamber] : gas.pressure;
    const double fraction = chambers_.count() == 1 ? 1 : volumes[chamber] / volumes.sum();
    all.volume += gas.volume;
    all.amount += gas.amount;
    all.pressure += fraction * gas.pressure;
    all.absolute_pressure += fraction * gas.absolute_pressure;
    all.temperature += fraction * gas.temperature;
    if (chambers_.was_there_at_first(chamber)) {
      initial_volume += chambers_.initial_volume(chamber);
      ++at_first;
    }
    if (chambers_.is_joined(chamber)) {
      energy += gas.amount * chambers_.heat_capacity(chamber) * gas.temperature;
    }
  }
  report.add("gas_volume", "m^3", all.volume);
  report.add("gas_volume_ratio", "", initial_volume != 0 ? all.volume / initial_volume : 0);
  report.add("gas_pressure", "Pa", all.pressure);
  report.add("gas_absolute_pressure", "Pa", all.absolute_pressure);
  report.add("gas_amount", "mol", all.amount);
  report.add("gas_temperature", "K", all.temperature);
  for (int chamber = 0; chamber < (at_first > 1 ? at_first : 0); ++chamber) {
    const std::string& name = chambers_.name(chamber);
    const std::string owner = "chambers." + name;
    report.add("gas_volume_" + name, "m^3", states[chamber].volume, owner);
    report.add("gas_pressure_" + name, "Pa", states[chamber].pressure, owner);
    report.add("gas_amount_" + name, "mol", states[chamber].amount, owner);
    report.add("gas_temperature_" + name, "K", states[chamber].temperature, owner);
  }
  if (state_.gas == nullptr) {
    return;
  }
  report.add("gas_energy", "J", energy);
  report.add("gas_work", "J", state_.gas->work.sum());
  report.add("gas_wall_heat", "J", state_.gas->wall_heat.sum());
  report.add("gas_leak", "mol", state_.gas->leak_amount.sum());
  report.add("gas_leak_enthalpy", "J", state_.gas->leak_enthalpy.sum());
  Eigen::Index link = 0;
  for (const Chambers::Link& joins : chambers_.links()) {
    const std::string owner = "gas_network.links." + joins.name;
    report.add("through_" + joins.name, "mol", state_.gas->link_amount[link], owner);
    report.add("enthalpy_" + joins.name, "J", state_.gas->link_enthalpy[link], owner);
    ++link;
  }
}

/// Whether each chamber has opened permanently or become a part of another; empty if gas does not flow.
std::vector<bool> GasStage::opened() const {
  std::vector<bool> opened;
  for (int chamber = 0; state_.gas != nullptr && chamber < state_.gas->chambers(); ++chamber) {
    opened.push_back(state_.gas->is_part(chamber) || state_.gas->is_open(chamber));
  }
  return opened;
}

/// Adds lines that report chambers which have opened permanently or become parts of others since `before`.
void GasStage::add_newly_open(const std::vector<bool>& before, double time, std::vector<std::string>& lines) const {
  const std::vector<bool> now = opened();
  for (int chamber = 0; chamber < static_cast<int>(before.size()); ++chamber) {
    if (!now[chamber] || before[chamber]) {
      continue;
    }
    const std::string why = " at " + time_text(time) + ": its holes are large, and its pressure is that ";
    if (state_.gas->is_part(chamber)) {
      lines.push_back("chamber " + chambers_.name(chamber) + " becomes a part of " +
                      chambers_.name(state_.gas->gas_inside(chamber)) + why + "round it");
    } else {
      lines.push_back("chamber " + chambers_.name(chamber) + " is open for good" + why + "outside");
    }
  }
}

std::vector<std::string> GasStage::divide() {
  if (state_.gas == nullptr) {
    return {};
  }
  const std::vector<bool> before = opened();
  std::optional<Chambers::Division> division =
      chambers_.divided(state_.burning->pieces.of_particle, *state_.gas, state_.position, state_.time);
  if (!division) {
    return {};
  }
  state_.chamber = std::move(division->numbers);
  *state_.gas = std::move(division->exchange);
  state_.pressure.conservativeResizeLike(Eigen::VectorXd::Zero(state_.gas->chambers()));
  for (std::string& line : division->lines) {
    line += " at " + time_text(state_.time);
  }
  add_newly_open(before, state_.time, division->lines);
  return division->lines;
}

std::string GasStage::open_wall(bool can_crack) const {
  if (!state_.burning) {
    return "";
  }
  const std::string hole = burnt_hole();
  return hole.empty() && can_crack ? torn_wall() : hole;
}

/// Names a chamber that needs a closed surface but has a burnt hole, and its place; empty: there is none.
std::string GasStage::burnt_hole() const {
  const PetscInt per_element = surface_.triangles_per_element;
  Opening first{HUGE_VAL};
  for (PetscInt e = 0; e < surface_.elements.owned; ++e) {
    const int chamber = chambers_.of_triangle(per_element * e);
    if (state_.burning->burn_time[e] >= 0 && surface_.element_id[e] < first[0] && chamber >= 0 &&
        chambers_.needs_closed_wall(chamber)) {
      Eigen::Vector3d x = Eigen::Vector3d::Zero();
      for (PetscInt t = per_element * e; t < per_element * (e + 1); ++t) {
        for (const PetscInt point : surface_.triangles[t]) {
          x += state_.position.vector(point) / static_cast<double>(3 * per_element);
        }
      }
      first = {static_cast<double>(surface_.element_id[e]), x[0], x[1], x[2], static_cast<double>(chamber)};
    }
  }
  if (!on_any_rank(surface_.comm(), first[0] < HUGE_VAL)) {
    return "";
  }
  const auto [id, x, y, z, chamber] = first_of_all(surface_.comm(), first);
  return fmt::format("chamber {} is open: element {} at ({:.4g}, {:.4g}, {:.4g}) m has burnt through",
                     chambers_.name(static_cast<int>(chamber)), static_cast<int>(id), x, y, z);
}

/// Names a chamber that needs a closed surface which cracks have parted, and the place; empty: there is none.
std::string GasStage::torn_wall() const {
  if (chambers_.count() == 0) {
    return "";
  }
  const SplitCorners corners = find_split_corners(surface_, state_.burning->active);
  if (corners.count == 0) {
    return "";
  }
  std::map<PetscInt, int> chamber_of;  // of vertices of triangles that may not part
  for (std::size_t triangle = 0; triangle < surface_.triangles.size(); ++triangle) {
    const int chamber = chambers_.of_triangle(static_cast<PetscInt>(triangle));
    if (chamber >= 0 && chambers_.needs_closed_wall(chamber)) {
      for (const PetscInt vertex : surface_.triangles[triangle]) {
        chamber_of[vertex] = chamber;
      }
    }
  }
  Opening first{HUGE_VAL};
  for (const SplitCorners::Copy& copy : corners.copies) {
    if (const auto found = chamber_of.find(copy.original); found != chamber_of.end()) {
      const double id = surface_.persistent_id[copy.original];
      const Eigen::Vector3d x = state_.position.vector(copy.original);
      first = std::min(first, {id, x[0], x[1], x[2], static_cast<double>(found->second)});
    }
  }
  const auto [id, x, y, z, chamber] = first_of_all(surface_.comm(), first);
  if (id == HUGE_VAL) {
    return "";
  }
  // A coordinate that is rounding is 0, so that the words do not depend on the ranks.
  const double rounding = 1e-9 * std::hypot(x, y, z);
  const auto shown = [rounding](double coordinate) { return std::abs(coordinate) < rounding ? 0.0 : coordinate; };
  return fmt::format("chamber {} is open: it has torn at vertex {} at ({:.4g}, {:.4g}, {:.4g}) m",
                     chambers_.name(static_cast<int>(chamber)), static_cast<int>(id), shown(x), shown(y), shown(z));
}

}  // namespace pellicle::world
