#include "gas/chambers.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <set>
#include <utility>

#include "base/error.h"
#include "base/sorting.h"
#include "base/units.h"
#include "gas/chamber_keys.h"
#include "geometry/key_points.h"
#include "parallel/collective.h"

namespace pellicle::gas {

Chambers::Chambers(const Surface& surface, const GasOptions& gas, const std::map<std::string, ChamberOptions>& options,
                   const Eigen::Vector3d& origin, const SymmetryPlanes& planes, const Projectors& projectors)
    : surface_(&surface), gas_(gas), origin_(origin), planes_(planes) {
  for (const auto& [name, given] : options) {
    require_valid_chamber("chambers." + name, given, gas.ambient_pressure);
  }
  const NamedPieces named = name_pieces(surface, options);
  for (const auto& [name, given] : named.chambers) {
    chambers_.push_back({name, *given});
  }
  for (const int piece : surface.piece) {
    chamber_of_element_.push_back(named.chamber_of_piece[piece]);
  }
  initial_exchange_ = GasExchange(count(), static_cast<int>(gas.links.size()));
  set_nesting();
  Field rest(surface.particles, 3);
  rest.values() = surface.rest;
  set_initial_volumes(rest);

  for (std::size_t piece = 0; piece < named.chamber_of_piece.size(); ++piece) {
    const int number = named.chamber_of_piece[piece];
    if (number < 0 || !needs_volume(number)) {
      continue;
    }
    const Chamber& chamber = of(number);
    if (!surface.piece_is_closed[piece] && !vents(number)) {
      if (planes.normals.empty()) {
        throw Error("chambers." + chamber.name + ".law: " + chamber.options.law.name() +
                    " needs a volume, but the piece is open, expected a closed piece" +
                    (surface.has_quads() ? "" : ", symmetry planes") + " or the law pressure");
      }
      require_closed(number, rest, projectors);
    }
    if (!(chamber.initial_volume > 0)) {
      throw Error("chambers." + chamber.name + ": the piece encloses " + number_text(chamber.initial_volume) +
                  " m^3, expected more than 0, with normals outward");
    }
  }
  for (int chamber = 0; chamber < count(); ++chamber) {
    require_inside(chamber, rest);
  }
  set_amounts();
  find_joined();
}

Chambers::Chambers(const Surface& surface, const GasOptions& gas, const std::map<std::string, ChamberOptions>& options,
                   const Eigen::Vector3d& origin, const std::vector<PetscInt>& numbers, const GasExchange* exchange,
                   const SymmetryPlanes& planes)
    : surface_(&surface), gas_(gas), origin_(origin), planes_(planes), chamber_of_element_(numbers) {
  PetscInt last =
      max_over_ranks(surface.comm(), numbers.empty() ? -1 : *std::max_element(numbers.begin(), numbers.end()));
  PetscInt parts = 0;
  if (exchange != nullptr) {
    last = static_cast<PetscInt>(exchange->parent.size()) - 1;
    parts = static_cast<PetscInt>(
        std::count_if(exchange->parent.begin(), exchange->parent.end(), [](PetscInt chamber) { return chamber >= 0; }));
  }
  const auto with_vertex =
      std::count_if(options.begin(), options.end(), [](const auto& chamber) { return chamber.second.vertex >= 0; });
  for (const auto& [name, given] : options) {
    require_valid_chamber("chambers." + name, given, gas.ambient_pressure);
    const auto pieces = given.vertex < 0 ? static_cast<int>(last + 1 - parts - with_vertex) : 1;
    for (int piece = 1; piece <= pieces; ++piece) {
      chambers_.push_back({name_of_piece(name, piece), given});
    }
  }
  for (PetscInt part = last + 1 - parts; part <= last; ++part) {
    const auto parent = static_cast<int>(exchange->parent[part]);
    Chamber chamber = of(parent);
    chamber.parent = parent;
    chamber.name = name_of_piece(chamber.name + "_cut", static_cast<int>(part - (last - parts)));
    chamber.options.amount = {{0, 0}};
    chambers_.push_back(std::move(chamber));
  }
  initial_exchange_ = GasExchange(count(), static_cast<int>(gas.links.size()));
  if (exchange != nullptr) {
    initial_exchange_.inside = exchange->inside;
    initial_exchange_.outside = exchange->outside;
    initial_exchange_.parent = exchange->parent;
  }
  Field rest(surface.particles, 3);
  rest.values() = surface.rest;
  set_initial_volumes(rest);
  for (PetscInt chamber = 0; exchange != nullptr && chamber <= last; ++chamber) {
    chambers_[chamber].initial_volume = exchange->reference_volume[chamber];
  }
  set_amounts();
  find_joined();
}

/// Sets the initial volumes of chambers whose elements are known, all of them active. Collective.
void Chambers::set_initial_volumes(const Field& rest) {
  set_active(ActiveSet(*surface_));
  const Eigen::VectorXd volume = initial_exchange_.gas_volumes(volumes(rest));
  for (int chamber = 0; chamber < count(); ++chamber) {
    chambers_[chamber].initial_volume = volume[chamber];
  }
}

/// Sets defaults for what the options of chambers with an amount of gas leave out.
void Chambers::set_amounts() {
  for (Chamber& chamber : chambers_) {
    if (!chamber.has_amount()) {
      continue;
    }
    ChamberOptions& given = chamber.options;
    chamber.gamma = given.gamma.value_or(default_gamma);
    if (given.temperature.empty()) {
      given.temperature = {{0, default_temperature}};
    }
    if (given.amount.empty()) {
      if (!(gas_.ambient_pressure > 0)) {
        throw Error("chambers." + chamber.name +
                    ".amount: not given, expected n in mol where gas.ambient_pressure is 0");
      }
      given.amount = given.amount_ratio.empty() ? Rows{{0, 1}} : given.amount_ratio;
      chamber.unit_amount =
          gas_.ambient_pressure * chamber.initial_volume / (gas_constant * value_on_key_points(given.temperature, 0));
    }
  }
}

/// Number of the chamber of a name. @param others further values of the key, in words @throws Error if there is none
int Chambers::number_of(const std::string& name, const std::string& key, const std::string& others) const {
  std::string names;
  for (int chamber = 0; chamber < count(); ++chamber) {
    if (of(chamber).name == name) {
      return chamber;
    }
    names += (names.empty() ? "" : ", ") + of(chamber).name;
  }
  throw Error(key + ": there is no chamber " + name + ", expected " + (names.empty() ? "chambers" : names) + others);
}

/// Sets which chambers lie inside others, from the options.
void Chambers::set_nesting() {
  for (int chamber = 0; chamber < count(); ++chamber) {
    const Chamber& self = of(chamber);
    if (self.options.inside.empty()) {
      continue;
    }
    const std::string key = "chambers." + self.name + ".inside";
    const int round = number_of(self.options.inside, key, "");
    initial_exchange_.outside[chamber] = round;
    for (const int either : {chamber, round}) {
      if (!of(either).has_amount()) {
        throw Error(key + ": chamber " + of(either).name + " has the law " + of(either).options.law.name() +
                    ", expected isothermal or adiabatic inside another chamber and round one");
      }
    }
    if (of(round).options.gamma.value_or(default_gamma) != self.options.gamma.value_or(default_gamma) &&
        (vents(chamber) || self.options.permeability > 0)) {
      throw Error(key + ": gas flows between chambers of unlike gamma, expected one gas");
    }
  }
  for (int chamber = 0; chamber < count(); ++chamber) {
    int round = chamber;
    for (int level = 0; level <= count() && round >= 0; ++level) {
      round = static_cast<int>(initial_exchange_.outside[round]);
    }
    if (round >= 0) {
      throw Error("chambers." + of(chamber).name + ".inside: " + of(chamber).options.inside +
                  " lies inside it in turn, expected a chamber round it");
    }
  }
}

/// Checks that a chamber lies inside another where the options say so. Collective.
void Chambers::require_inside(int chamber, const Field& rest) const {
  const int round = initial_exchange_.gas_outside(chamber);
  if (round < 0 || !planes_.normals.empty()) {  // A part of a wall says nothing of what is in the whole.
    return;
  }
  constexpr double least_winding = 0.25;  // round an open wall it is less than 1
  if (!(windings(chamber, rest, chamber_of_triangle_, count())[round] > least_winding)) {
    throw Error("chambers." + of(chamber).name + ".inside: its piece does not lie in that of chamber " +
                of(round).name + ", expected a chamber round it");
  }
}

/// Finds the joined chambers and the links.
void Chambers::find_joined() {
  is_joined_.assign(chambers_.size(), false);
  const auto require_joinable = [&](int chamber, const std::string& key) {
    is_joined_[chamber] = true;
    const Chamber& self = of(chamber);
    if (!self.has_amount()) {
      throw Error(key + ": chamber " + self.name + " has the law " + self.options.law.name() +
                  ", expected isothermal or adiabatic, by which it has an amount of gas");
    }
    if (self.options.amount.size() > 1) {
      throw Error(key + ": the amount of chambers." + self.name + " is given in " +
                  std::to_string(self.options.amount.size()) +
                  " key points, expected one, the amount at first: links change it");
    }
    if (!(self.options.amount.front()[1] > 0) && self.parent < 0) {
      throw Error(key + ": there is no gas in chamber " + self.name + " at first, expected an amount above 0");
    }
  };
  const auto end_of = [&](const std::string& name, const std::string& key) {
    if (name.empty() || name == "ambient") {
      return GasNetwork::ambient;
    }
    if (name.find('.') != std::string::npos) {
      return elsewhere;
    }
    const int chamber = number_of(name, key, " or ambient");
    require_joinable(chamber, key);
    return chamber;
  };
  for (const auto& [name, options] : gas_.links) {
    const std::string key = "gas_network.links." + name;
    links_.push_back({name, end_of(options.from, key + ".from"), end_of(options.to, key + ".to"), options});
  }
  for (int chamber = 0; chamber < count(); ++chamber) {
    const ChamberOptions& options = of(chamber).options;
    const auto round = static_cast<int>(initial_exchange_.outside[chamber]);
    const std::string key = "chambers." + of(chamber).name;
    for (const auto& [joins, name] :
         {std::pair(options.heat_transfer > 0, ".heat_transfer"), std::pair(options.permeability > 0, ".permeability"),
          std::pair(options.hole_discharge.has_value(), ".hole_discharge"), std::pair(round >= 0, ".inside")}) {
      if (joins) {
        require_joinable(chamber, key + name);
      }
    }
    if (round >= 0) {
      require_joinable(round, key + ".inside");
    }
  }
  for (int chamber = 0; chamber < count(); ++chamber) {
    if (is_joined_[chamber]) {
      joined_.push_back(chamber);
    }
  }
}

Chambers::Vessels Chambers::vessels(const GasExchange& exchange, int first) const {
  Vessels result;
  result.of_chamber.assign(chambers_.size(), -1);
  for (const int chamber : joined_) {
    if (!exchange.is_part(chamber)) {
      result.of_chamber[chamber] = first + static_cast<int>(result.chambers.size());
      result.chambers.push_back(chamber);
    }
  }
  for (const int chamber : joined_) {
    result.of_chamber[chamber] = result.of_chamber[exchange.gas_inside(chamber)];
  }
  return result;
}

/// The parts of the walls of chambers that vent, by the pieces of the surface.
struct Chambers::WallParts {
  /// Chamber and piece.
  using Part = std::pair<int, PetscInt>;

  std::vector<Part> parts;       ///< ascending, the same on every rank
  std::vector<int> of_triangle;  ///< number of the part of each local triangle, by its first corner; -1: none

  int count() const { return static_cast<int>(parts.size()); }
};

/// The parts of the walls of chambers that vent, are not open and have gas of their own. Collective.
Chambers::WallParts Chambers::wall_parts(const std::vector<PetscInt>& piece, const GasExchange& exchange) const {
  using Part = WallParts::Part;
  const Part none(-1, -1);
  std::vector<Part> part_of;  // of each local triangle
  for (std::size_t triangle = 0; triangle < surface_->triangles.size(); ++triangle) {
    const int chamber = chamber_of_triangle_[triangle];
    const PetscInt here = piece[surface_->triangles[triangle].front()];
    const bool is_part =
        chamber >= 0 && here >= 0 && vents(chamber) && !exchange.is_open(chamber) && !exchange.is_part(chamber);
    part_of.push_back(is_part ? Part(chamber, here) : none);
  }
  WallParts walls{without_repeats(of_all_ranks(surface_->comm(), without_repeats(part_of))), {}};
  walls.parts.erase(std::remove(walls.parts.begin(), walls.parts.end(), none), walls.parts.end());
  for (const Part& part : part_of) {
    const auto place = std::lower_bound(walls.parts.begin(), walls.parts.end(), part) - walls.parts.begin();
    walls.of_triangle.push_back(part == none ? -1 : static_cast<int>(place));
  }
  return walls;
}

std::optional<Chambers::Division> Chambers::divided(const std::vector<PetscInt>& piece, const GasExchange& exchange,
                                                    const Field& positions, double time) const {
  const WallParts walls = wall_parts(piece, exchange);
  const auto are_alike = [](const WallParts::Part& a, const WallParts::Part& b) { return a.first == b.first; };
  if (std::adjacent_find(walls.parts.begin(), walls.parts.end(), are_alike) == walls.parts.end()) {
    return std::nullopt;
  }
  const Rims rims(*surface_, walls.of_triangle, origin_, planes_);
  Eigen::VectorXd volume = volumes(positions, walls.of_triangle, rims, walls.count());  // of the gas in each part
  const Eigen::VectorXd enclosed = volumes(positions);
  std::vector<std::pair<int, int>> nested;  // chambers inside parts, each with the part that winds round it most
  for (int chamber = 0; chamber < count(); ++chamber) {
    const int round = exchange.gas_outside(chamber);
    if (exchange.is_part(chamber) || round < 0) {
      continue;
    }
    const Eigen::VectorXd winding = windings(chamber, positions, walls.of_triangle, walls.count());
    int most = -1;
    for (int part = 0; part < walls.count(); ++part) {
      if (walls.parts[part].first == round && (most < 0 || winding[part] > winding[most])) {
        most = part;
      }
    }
    if (most >= 0) {
      nested.emplace_back(chamber, most);
      volume[most] -= enclosed[chamber];
    }
  }

  Division division{chamber_of_element_, exchange, {}};
  const std::vector<int> chamber_of_part = divide_gas(division, walls, volume, time);
  for (const auto& [chamber, part] : nested) {
    division.exchange.outside[chamber] = chamber_of_part[part];
  }
  for (std::size_t triangle = 0; triangle < walls.of_triangle.size(); ++triangle) {
    if (const int part = walls.of_triangle[triangle]; part >= 0) {
      division.numbers[surface_->element_of_triangle(triangle)] = chamber_of_part[part];
    }
  }
  return division;
}

/// Divides the gas of each chamber among the large parts of its wall, and adds a chamber for each of them but the
/// first.
/// @param volume of the gas in each part [m^3] @returns the chamber of each part, -1: none
std::vector<int> Chambers::divide_gas(Division& division, const WallParts& walls, const Eigen::VectorXd& volume,
                                      double time) const {
  constexpr double least_share = 0.01;  // of the volume
  const GasExchange before = division.exchange;
  std::vector<int> chamber_of_part(walls.parts.size(), -1);
  std::vector<Content> contents = this->contents(before, time);
  std::set<int> changed;
  for (int first = 0, end = 0; first < walls.count(); first = end) {
    const int chamber = walls.parts[first].first;
    std::vector<int> large;
    for (end = first; end < walls.count() && walls.parts[end].first == chamber; ++end) {
      if (volume[end] > least_share * before.volume[chamber]) {
        large.push_back(end);
      }
    }
    chamber_of_part[large.empty() ? first : large.front()] = chamber;
    if (large.size() < 2) {
      continue;
    }
    const Content gas = contents[chamber];
    double left = 1;
    std::string line = "chamber " + name(chamber) + " is cut in " + std::to_string(large.size()) + " of";
    for (const int part : large) {
      int& number = chamber_of_part[part];
      if (number < 0) {
        number = division.exchange.chambers();
        division.exchange.add_part(chamber);
        contents.push_back(Content::Zero());
      }
      division.exchange.volume[number] = volume[part];
      const double share = volume[part] / before.volume[chamber];
      left -= share;
      contents[number] = share * gas;
      changed.insert(number);
      line += fmt::format("{} {:.4g} m^3", part == large.front() ? "" : ",", volume[part]);
    }
    division.lines.push_back(line);
    leak_out(division.exchange, contents, chamber, left * gas);  // the rest
    if (const int round = before.gas_outside(chamber); round >= 0) {
      changed.insert(round);
    }
  }
  for (const int number : changed) {
    const int like = number < count() ? number : static_cast<int>(division.exchange.parent[number]);
    fill(division.exchange, number, like, contents[number], division.exchange.volume[number]);
  }
  return chamber_of_part;
}

}  // namespace pellicle::gas
