#include "gas/chambers.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numeric>
#include <set>
#include <utility>

#include "base/error.h"
#include "base/units.h"
#include "geometry/key_points.h"
#include "geometry/pi.h"
#include "geometry/pressure_load.h"
#include "parallel/collective.h"

namespace pellicle {
inline namespace gas {

namespace {

constexpr double default_temperature = 293.15;  // [K]
constexpr double default_gamma = 1.4;

/// Key points of a chamber: which, what their values may be, which laws use them.
struct Quantity {
  const char* key;
  Rows ChamberOptions::*rows;
  double lowest;
  bool may_be_lowest;
  std::vector<GasLaw> laws;
};

const std::vector<Quantity>& quantities() {
  static const std::vector<Quantity> all{
      {"pressure", &ChamberOptions::pressure, 0, true, {GasLaw::relative, GasLaw::pressure}},
      {"amount", &ChamberOptions::amount, 0, true, {GasLaw::isothermal, GasLaw::adiabatic}},
      {"amount_ratio", &ChamberOptions::amount_ratio, 0, true, {GasLaw::isothermal, GasLaw::adiabatic}},
      {"temperature", &ChamberOptions::temperature, 0, false, {GasLaw::isothermal, GasLaw::adiabatic}},
      {"volume_ratio", &ChamberOptions::volume_ratio, 0, false, {GasLaw::volume}},
      {"volume", &ChamberOptions::volume, 0, false, {GasLaw::volume}}};
  return all;
}

[[noreturn]] void refuse_for_law(const std::string& key, const std::string& law) {
  throw Error(key + ": given, but the law " + law + " does not use it, expected another law or no such key");
}

/// @param ambient_pressure [Pa], by which a gauge pressure may be below 0
void require_valid(const std::string& chamber, const ChamberOptions& options, double ambient_pressure) {
  for (const Quantity& quantity : quantities()) {
    const Rows& rows = options.*quantity.rows;
    const std::string key = chamber + "." + quantity.key;
    if (rows.empty()) {
      continue;
    }
    if (std::find(quantity.laws.begin(), quantity.laws.end(), GasLaw(options.law)) == quantity.laws.end()) {
      refuse_for_law(key, options.law.name());
    }
    if (const std::string fault = fault_of_key_points(rows, {"time", "value"}); !fault.empty()) {
      throw Error(key + ": " + fault);
    }
    const bool is_gauge = &rows == &options.pressure && options.law == GasLaw::pressure;
    const double lowest = is_gauge ? -ambient_pressure : quantity.lowest;
    for (const auto& row : rows) {
      if (!(quantity.may_be_lowest ? row[1] >= lowest : row[1] > lowest)) {
        throw Error(key + ": " + number_text(row[1]) + " at " + number_text(row[0]) + " s, expected " +
                    (quantity.may_be_lowest ? "at least " : "more than ") + number_text(lowest) +
                    (is_gauge ? ", a vacuum inside where gas.ambient_pressure is outside" : ""));
      }
    }
  }
  if (options.gamma && options.law != GasLaw::adiabatic) {
    refuse_for_law(chamber + ".gamma", options.law.name());
  }
  if (options.law == GasLaw::adiabatic && options.temperature.size() > 1) {
    throw Error(chamber + ".temperature: " + std::to_string(options.temperature.size()) +
                " key points, expected one with the law adiabatic: the temperature at the undeformed volume");
  }
  const auto refuse_pair = [&](const std::string& pair) {
    throw Error(chamber + ": " + pair + " given, expected one of them");
  };
  if (!options.amount.empty() && !options.amount_ratio.empty()) {
    refuse_pair("both amount and amount_ratio");
  }
  if (!options.volume.empty() && !options.volume_ratio.empty()) {
    refuse_pair("both volume and volume_ratio");
  }
  if (options.law == GasLaw::volume && options.volume.empty() && options.volume_ratio.empty()) {
    refuse_pair("neither volume nor volume_ratio");
  }
  if ((options.law == GasLaw::relative || options.law == GasLaw::pressure) && options.pressure.empty()) {
    throw Error(chamber + ".pressure: not given, expected key points (time, pressure) with the law " +
                options.law.name());
  }
}

/// The piece to which a vertex belongs. Collective.
int piece_of_vertex(const Surface& surface, const std::string& chamber, int vertex) {
  int piece = -1;
  for (std::size_t triangle = 0; triangle < surface.triangles.size(); ++triangle) {
    for (const PetscInt corner : surface.triangles[triangle]) {
      if (surface.persistent_id[corner] == vertex) {
        piece = surface.piece[triangle / static_cast<std::size_t>(surface.triangles_per_element)];
      }
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, &piece, 1, MPI_INT, MPI_MAX, surface.comm());
  if (piece < 0) {
    throw Error(chamber + ".vertex: " + std::to_string(vertex) + " is no vertex of the mesh, expected one of it");
  }
  return piece;
}

/// The name of a chamber that stands for several pieces, for each of them, from 1 on.
std::string name_of(const std::string& name, int piece) {
  return piece == 1 ? name : name + "_" + std::to_string(piece);
}

/// The chamber of each piece, -1 where there is none, and the chambers' names and options in their order. Collective.
struct NamedPieces {
  std::vector<int> chamber_of_piece;
  std::vector<std::pair<std::string, const ChamberOptions*>> chambers;
};

NamedPieces name_pieces(const Surface& surface, const std::map<std::string, ChamberOptions>& options) {
  NamedPieces result;
  std::vector<std::string> taken(surface.pieces());  // by which chamber
  std::string rest;                                  // the chamber without a vertex
  for (const auto& [name, given] : options) {
    if (given.vertex < 0) {
      if (!rest.empty()) {
        throw Error("chambers." + name + ".vertex: not given, as for chambers." + rest +
                    ", expected one chamber for the pieces that no other names");
      }
      rest = name;
      continue;
    }
    std::string& owner = taken[piece_of_vertex(surface, "chambers." + name, given.vertex)];
    if (!owner.empty()) {
      throw Error("chambers." + name + ".vertex: " + std::to_string(given.vertex) + " is of the piece that chambers." +
                  owner + " names, expected another piece");
    }
    owner = name;
  }
  result.chamber_of_piece.assign(taken.size(), -1);
  for (const auto& [name, given] : options) {
    int found = 0;
    for (std::size_t piece = 0; piece < taken.size(); ++piece) {
      if (taken[piece] == (given.vertex < 0 ? "" : name)) {
        ++found;
        result.chamber_of_piece[piece] = static_cast<int>(result.chambers.size());
        result.chambers.emplace_back(name_of(name, found), &given);
      }
    }
    if (found == 0) {
      throw Error("chambers." + name + ": other chambers name all pieces of the mesh, expected a piece for it");
    }
  }
  return result;
}

}  // namespace

Chambers::Chambers(const Surface& surface, const GasOptions& gas, const std::map<std::string, ChamberOptions>& options,
                   const Eigen::Vector3d& origin, const SymmetryPlanes& planes, const Projectors& projectors)
    : surface_(&surface), gas_(gas), origin_(origin), planes_(planes) {
  for (const auto& [name, given] : options) {
    require_valid("chambers." + name, given, gas.ambient_pressure);
  }
  const NamedPieces named = name_pieces(surface, options);
  for (const auto& [name, given] : named.chambers) {
    add(name, *given);
  }
  for (const int piece : surface.piece) {
    chamber_of_element_.push_back(named.chamber_of_piece[piece]);
  }
  exchange_ = GasExchange(count(), static_cast<int>(gas.links.size()));
  nest();
  begin();

  Field rest(surface.particles, 3);
  rest.values() = surface.rest;
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
    require_inside(chamber);
  }
  set_amounts();
  join();
}

Chambers::Chambers(const Surface& surface, const GasOptions& gas, const std::map<std::string, ChamberOptions>& options,
                   const Eigen::Vector3d& origin, const std::vector<PetscInt>& numbers, const GasExchange* exchange,
                   const SymmetryPlanes& planes)
    : surface_(&surface), gas_(gas), origin_(origin), planes_(planes), chamber_of_element_(numbers) {
  PetscInt last = -1;
  for (const PetscInt number : numbers) {
    last = std::max(last, number);
  }
  MPI_Allreduce(MPI_IN_PLACE, &last, 1, MPIU_INT, MPI_MAX, surface.comm());
  PetscInt parts = 0;
  if (exchange != nullptr) {
    last = static_cast<PetscInt>(exchange->parent.size()) - 1;
    parts = static_cast<PetscInt>((exchange->parent.array() >= 0).count());
  }
  const auto with_vertex =
      std::count_if(options.begin(), options.end(), [](const auto& chamber) { return chamber.second.vertex >= 0; });
  for (const auto& [name, given] : options) {
    require_valid("chambers." + name, given, gas.ambient_pressure);
    const auto pieces = given.vertex < 0 ? static_cast<int>(last + 1 - parts - with_vertex) : 1;
    for (int piece = 1; piece <= pieces; ++piece) {
      add(name_of(name, piece), given);
    }
  }
  for (PetscInt part = last + 1 - parts; part <= last; ++part) {
    Chamber chamber = of(static_cast<int>(exchange->parent[part]));
    chamber.parent = static_cast<int>(exchange->parent[part]);
    chamber.name = name_of(chamber.name + "_cut", static_cast<int>(part - (last - parts)));
    chamber.options.amount = {{0, 0}};
    chambers_.push_back(std::move(chamber));
  }
  exchange_ = exchange != nullptr ? *exchange : GasExchange(count(), static_cast<int>(gas.links.size()));
  begin();
  for (PetscInt chamber = 0; exchange != nullptr && chamber <= last; ++chamber) {
    chambers_[chamber].initial_volume = exchange->reference_volume[chamber];
  }
  set_amounts();
  join();
}

void Chambers::add(const std::string& name, const ChamberOptions& options) {
  Chamber& chamber = chambers_.emplace_back();
  chamber.name = name;
  chamber.law = options.law;
  chamber.options = options;
}

/// Of chambers whose elements are known: all of these are there; initial volumes. Collective.
void Chambers::begin() {
  set_living(Living(*surface_));
  Field rest(surface_->particles, 3);
  rest.values() = surface_->rest;
  const Eigen::VectorXd volume = gas_volumes(volumes(rest));
  for (std::size_t chamber = 0; chamber < chambers_.size(); ++chamber) {
    chambers_[chamber].initial_volume = volume[static_cast<Eigen::Index>(chamber)];
  }
}

/// What is missing in the options for their laws.
void Chambers::set_amounts() {
  for (Chamber& chamber : chambers_) {
    if (chamber.law != GasLaw::isothermal && chamber.law != GasLaw::adiabatic) {
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

/// Of a chamber. @param others what else the key may say, in words @throws Error if there is none of this name
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

/// Which chambers lie inside others, as the options say.
void Chambers::nest() {
  for (int chamber = 0; chamber < count(); ++chamber) {
    const Chamber& self = of(chamber);
    if (self.options.inside.empty()) {
      continue;
    }
    const std::string key = "chambers." + self.name + ".inside";
    const int round = number_of(self.options.inside, key, "");
    exchange_.outside[chamber] = round;
    for (const int either : {chamber, round}) {
      if (of(either).law != GasLaw::isothermal && of(either).law != GasLaw::adiabatic) {
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
      round = static_cast<int>(exchange_.outside[round]);
    }
    if (round >= 0) {
      throw Error("chambers." + of(chamber).name + ".inside: " + of(chamber).options.inside +
                  " lies inside it in turn, expected a chamber round it");
    }
  }
}

/// Checks that a chamber lies inside another where the options say so. Collective.
void Chambers::require_inside(int chamber) const {
  const int round = static_cast<int>(exchange_.outside[chamber]);
  if (round < 0 || !planes_.normals.empty()) {  // A part of a wall says nothing of what is in the whole.
    return;
  }
  constexpr double least_winding = 0.25;  // round an open wall it is less than 1
  Field rest(surface_->particles, 3);
  rest.values() = surface_->rest;
  std::vector<int> is_round;
  for (const int of_triangle : chamber_of_triangle_) {
    is_round.push_back(of_triangle == round ? 0 : -1);
  }
  if (!(windings(chamber, rest, is_round, 1)[0] > least_winding)) {
    throw Error("chambers." + of(chamber).name + ".inside: its piece does not lie in that of chamber " +
                of(round).name + ", expected a chamber round it");
  }
}

/// How often surfaces wind round the middle of a chamber's wall: of its triangles and those that are numbered. 1: it is
/// inside a closed one. Collective. @param number_of_triangle up to the count, -1: of none
Eigen::VectorXd Chambers::windings(int chamber, const Field& positions, const std::vector<int>& number_of_triangle,
                                   int count) const {
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();  // of places, of how many
  for (PetscInt triangle = 0; triangle < owned_triangles(); ++triangle) {
    if (chamber_of_triangle_[triangle] == chamber) {
      for (const PetscInt corner : surface_->triangles[triangle]) {
        sum.head<3>() += positions.vector(corner);
        sum[3] += 1;
      }
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, sum.data(), 4, MPI_DOUBLE, MPI_SUM, surface_->comm());
  const Eigen::Vector3d middle = sum.head<3>() / std::max(sum[3], 1.0);
  Eigen::VectorXd result = Eigen::VectorXd::Zero(count);
  for (PetscInt triangle = 0; triangle < owned_triangles(); ++triangle) {
    if (const int number = number_of_triangle[triangle]; number >= 0) {
      const auto& corners = surface_->triangles[triangle];
      result[number] += solid_angle(positions.vector(corners[0]) - middle, positions.vector(corners[1]) - middle,
                                    positions.vector(corners[2]) - middle) /
                        (4 * pi);
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, result.data(), count, MPI_DOUBLE, MPI_SUM, surface_->comm());
  return result;
}

int Chambers::outside(int chamber) const {
  const auto round = static_cast<int>(exchange_.outside[chamber]);
  return round < 0 ? GasNetwork::ambient : inside(round);
}

Eigen::VectorXd Chambers::gas_volumes(const Eigen::VectorXd& walls) const {
  Eigen::VectorXd volumes = Eigen::VectorXd::Zero(count());
  for (int wall = 0; wall < count(); ++wall) {
    volumes[inside(wall)] += walls[wall];
    if (const int round = outside(wall); round >= 0) {
      volumes[round] -= walls[wall];
    }
  }
  return volumes;
}

/// The chambers of the vessels, each before the one round it.
std::vector<int> Chambers::from_within() const {
  std::vector<int> order = vessels_;
  const auto depth = [this](int chamber) {
    int levels = 0;
    for (int round = outside(chamber); round >= 0; round = outside(round)) {
      ++levels;
    }
    return levels;
  };
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return depth(a) > depth(b); });
  return order;
}

Eigen::VectorXd Chambers::last_volumes() const {
  Eigen::VectorXd walls = exchange_.volume;
  for (const int chamber : from_within()) {
    if (outside(chamber) >= 0) {
      walls[outside(chamber)] += walls[chamber];
    }
  }
  return walls;
}

/// Which chambers anything is joined to, and the links.
void Chambers::join() {
  std::vector<bool> is_joined(chambers_.size());
  const auto require_joinable = [&](int chamber, const std::string& key) {
    is_joined[chamber] = true;
    const Chamber& self = of(chamber);
    if (self.law != GasLaw::isothermal && self.law != GasLaw::adiabatic) {
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
    const std::string key = "chambers." + of(chamber).name;
    if (options.heat_transfer > 0) {
      require_joinable(chamber, key + ".heat_transfer");
    } else if (options.permeability > 0) {
      require_joinable(chamber, key + ".permeability");
    } else if (options.hole_discharge) {
      require_joinable(chamber, key + ".hole_discharge");
    }
    if (exchange_.outside[chamber] >= 0) {
      require_joinable(chamber, key + ".inside");
      require_joinable(static_cast<int>(exchange_.outside[chamber]), key + ".inside");
    }
  }
  for (int chamber = 0; chamber < count(); ++chamber) {
    if (is_joined[chamber]) {
      joined_.push_back(chamber);
    }
  }
  find_vessels();
}

/// To be called after a change of which gas is inside the walls.
void Chambers::find_vessels() {
  vessels_.clear();
  vessel_of_.assign(chambers_.size(), -1);
  for (const int chamber : joined_) {
    if (inside(chamber) == chamber) {
      vessel_of_[chamber] = static_cast<int>(vessels_.size());
      vessels_.push_back(chamber);
    }
  }
  for (const int chamber : joined_) {
    vessel_of_[chamber] = vessel_of_[inside(chamber)];
  }
}

GasNetwork::Vessel Chambers::vessel(int number) const {
  const Chamber& self = of(vessels_[number]);
  return {self.name, self.law == GasLaw::isothermal, self.gamma, self.initial_volume};
}

void Chambers::require_closed(int chamber, const Field& rest, const Projectors& projectors) const {
  // The triangles that close the piece join the edges of its boundary to the origin. They lie in the planes if they
  // contribute nothing to the derivative of the volume by any vertex, within its planes.
  Eigen::Matrix3Xd closing = -volume_gradient(chamber, rest);
  double scale = 0;
  for (std::size_t triangle = 0; triangle < surface_->triangles.size(); ++triangle) {
    if (chamber_of_triangle_[triangle] != chamber) {
      continue;
    }
    const auto& corners = surface_->triangles[triangle];
    for (std::size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3d second = rest.vector(corners[(k + 1) % 3]) - origin_;
      const Eigen::Vector3d third = rest.vector(corners[(k + 2) % 3]) - origin_;
      const Eigen::Vector3d share = second.cross(third) / 6;
      scale = std::max(scale, share.norm());
      if (corners[k] < surface_->particles.owned) {
        closing.col(corners[k]) += share;
      }
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, &scale, 1, MPI_DOUBLE, MPI_MAX, surface_->comm());
  constexpr double tolerance = 1e-5;  // a vertex counts as one in the plane a little off it
  auto open = std::numeric_limits<long long>::max();
  for (PetscInt i = 0; i < surface_->particles.owned; ++i) {
    const auto index = static_cast<std::size_t>(i);
    if ((projectors[index] * closing.col(i)).norm() > tolerance * scale) {
      open = std::min(open, static_cast<long long>(surface_->persistent_id[index]));
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, &open, 1, MPI_LONG_LONG, MPI_MIN, surface_->comm());
  if (open != std::numeric_limits<long long>::max()) {
    throw Error("chambers." + of(chamber).name + ".law: " + of(chamber).options.law.name() +
                " needs a volume, but the piece is open at vertex " + std::to_string(open) +
                ", expected its whole boundary in symmetry planes, or the law pressure");
  }
}

void Chambers::set_living(const Living& living) {
  const auto per_element = static_cast<std::size_t>(surface_->triangles_per_element);
  const std::vector<int> before = std::exchange(chamber_of_triangle_, std::vector<int>(living.triangles.size(), -1));
  std::vector<int> venting(living.triangles.size(), -1);
  has_hole_.assign(chambers_.size(), 0);
  const auto open = [this](PetscInt chamber) {
    if (chamber >= 0 && !needs_volume(static_cast<int>(chamber))) {
      has_hole_[chamber] = 1;
    }
  };
  for (std::size_t triangle = 0; triangle < living.triangles.size(); ++triangle) {
    const auto chamber = static_cast<int>(chamber_of_element_[triangle / per_element]);
    if ((living.triangles[triangle] && chamber >= 0) || (chamber >= 0 && needs_closed_wall(chamber))) {
      chamber_of_triangle_[triangle] = chamber;
      venting[triangle] = vents(chamber) ? chamber : -1;
    } else {
      open(chamber);
    }
  }
  for (std::size_t side = 0; side < living.cracked.size(); ++side) {
    if (living.cracked[side]) {
      open(chamber_of_element_[surface_->element_of_side(side)]);
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, has_hole_.data(), count(), MPI_INT, MPI_MAX, surface_->comm());
  if (before != chamber_of_triangle_ || before.empty()) {
    find_particles();
  }
  const bool can_vent = std::any_of(chambers_.begin(), chambers_.end(),
                                    [](const Chamber& chamber) { return chamber.options.hole_discharge.has_value(); });
  if (can_vent && on_any_rank(surface_->comm(), before != chamber_of_triangle_)) {
    rims_ = Rims(*surface_, venting, origin_, planes_);
  }
}

Eigen::VectorXd Chambers::volumes(const Field& positions) const {
  return volumes(positions, chamber_of_triangle_, rims_, count());
}

/// Of the volumes that some triangles and rims enclose. Collective. @param chamber_of_triangle up to the count, -1:
/// none
Eigen::VectorXd Chambers::volumes(const Field& positions, const std::vector<int>& chamber_of_triangle, const Rims& rims,
                                  int count) const {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(count);
  for (PetscInt triangle = 0; triangle < owned_triangles(); ++triangle) {
    if (const int chamber = chamber_of_triangle[triangle]; chamber >= 0) {
      const auto& corners = surface_->triangles[triangle];
      sum[chamber] += enclosed_volume(positions.vector(corners[0]) - origin_, positions.vector(corners[1]) - origin_,
                                      positions.vector(corners[2]) - origin_);
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, sum.data(), count, MPI_DOUBLE, MPI_SUM, surface_->comm());
  rims.add_volumes(positions, sum);
  return sum;
}

void GasExchange::add_part(int chamber) {
  const Eigen::Index count = parent.size() + 1;
  for (Eigen::VectorXd* values :
       {&amount, &heat, &open, &leak_amount, &leak_enthalpy, &wall_heat, &work, &first_energy, &volume}) {
    values->conservativeResizeLike(Eigen::VectorXd::Zero(count));
  }
  inside.conservativeResizeLike(Eigen::VectorXd::Constant(count, static_cast<double>(count - 1)));
  outside.conservativeResizeLike(Eigen::VectorXd::Constant(count, outside[chamber]));
  parent.conservativeResizeLike(Eigen::VectorXd::Constant(count, chamber));
  reference_volume.conservativeResizeLike(Eigen::VectorXd::Constant(count, reference_volume[chamber]));
}

std::optional<Chambers::Division> Chambers::divided(const std::vector<PetscInt>& piece, const GasExchange& exchange,
                                                    const Field& positions, double time) const {
  constexpr double least_share = 0.01;  // of the volume
  // The parts of walls: chamber and piece, of which a triangle has its first corner; the same on every rank.
  using Part = std::pair<int, PetscInt>;
  std::vector<std::optional<Part>> part_of(surface_->triangles.size());
  std::set<Part> own;
  for (std::size_t triangle = 0; triangle < part_of.size(); ++triangle) {
    const int chamber = chamber_of_triangle_[triangle];
    const PetscInt here = piece[surface_->triangles[triangle].front()];
    if (chamber >= 0 && vents(chamber) && exchange.open[chamber] == 0 && inside(chamber) == chamber && here >= 0) {
      part_of[triangle] = Part(chamber, here);
      own.insert(*part_of[triangle]);
    }
  }
  const std::vector<Part> gathered = of_all_ranks(surface_->comm(), std::vector<Part>(own.begin(), own.end()));
  const std::set<Part> all(gathered.begin(), gathered.end());
  const auto follows_its_like = [](const Part& a, const Part& b) { return a.first == b.first; };
  if (std::adjacent_find(all.begin(), all.end(), follows_its_like) == all.end()) {
    return std::nullopt;
  }
  const std::vector<Part> parts(all.begin(), all.end());
  std::vector<int> number_of(part_of.size(), -1);
  for (std::size_t triangle = 0; triangle < part_of.size(); ++triangle) {
    if (part_of[triangle]) {
      number_of[triangle] =
          static_cast<int>(std::lower_bound(parts.begin(), parts.end(), *part_of[triangle]) - parts.begin());
    }
  }
  const auto count_of_parts = static_cast<int>(parts.size());
  const Eigen::VectorXd enclosed =
      volumes(positions, number_of, Rims(*surface_, number_of, origin_, planes_), count_of_parts);
  const Eigen::VectorXd walls = volumes(positions);
  // What lies inside a chamber that is cut is inside the part that winds round it most.
  std::vector<std::pair<int, std::size_t>> inside_parts;
  Eigen::VectorXd volume_of = enclosed;  // of gas
  for (int chamber = 0; chamber < count(); ++chamber) {
    const int round = outside(chamber);
    if (inside(chamber) == chamber && round >= 0) {
      const Eigen::VectorXd winding = windings(chamber, positions, number_of, count_of_parts);
      std::optional<std::size_t> most;
      for (std::size_t part = 0; part < parts.size(); ++part) {
        const auto k = static_cast<Eigen::Index>(part);
        if (parts[part].first == round && (!most || winding[k] > winding[static_cast<Eigen::Index>(*most)])) {
          most = part;
        }
      }
      if (most) {
        inside_parts.emplace_back(chamber, *most);
        volume_of[static_cast<Eigen::Index>(*most)] -= walls[chamber];
      }
    }
  }

  Division division{chamber_of_element_, exchange, {}};
  std::vector<int> chamber_of_part(parts.size(), -1);
  std::vector<Content> contents;
  for (int chamber = 0; chamber < count(); ++chamber) {
    contents.push_back(is_joined(chamber) ? content(exchange, chamber, time) : Content());
  }
  std::set<int> changed;
  for (std::size_t first = 0, end = 0; first < parts.size(); first = end) {
    const int chamber = parts[first].first;
    const double whole = exchange.volume[chamber];
    std::vector<std::size_t> large;
    for (end = first; end < parts.size() && parts[end].first == chamber; ++end) {
      if (volume_of[static_cast<Eigen::Index>(end)] > least_share * whole) {
        large.push_back(end);
      }
    }
    chamber_of_part[large.empty() ? first : large.front()] = chamber;
    if (large.size() < 2) {
      continue;
    }
    const Content gas = contents[chamber];
    std::string line = "chamber " + name(chamber) + " is cut in " + std::to_string(large.size()) + " of";
    double left = 1;  // share of the gas
    for (const std::size_t part : large) {
      int& number = chamber_of_part[part];
      if (number < 0) {
        number = static_cast<int>(division.exchange.parent.size());
        division.exchange.add_part(chamber);
        contents.emplace_back();
      }
      const double volume = volume_of[static_cast<Eigen::Index>(part)];
      const double share = volume / whole;
      left -= share;
      contents[number] = {share * gas.amount, share * gas.heat};
      division.exchange.volume[number] = volume;
      changed.insert(number);
      char text[32];
      std::snprintf(text, sizeof text, "%s %.4g m^3", part == large.front() ? "" : ",", volume);
      line += text;
    }
    pass_out(division.exchange, contents, chamber, {left * gas.amount, left * gas.heat}, heat_capacity(chamber));
    if (outside(chamber) >= 0) {
      changed.insert(outside(chamber));
    }
    division.lines.push_back(line);
  }
  for (const auto& [chamber, part] : inside_parts) {
    division.exchange.outside[chamber] = chamber_of_part[part];
  }
  for (const int number : changed) {
    const int like = number < count() ? number : static_cast<int>(division.exchange.parent[number]);
    fill(division.exchange, number, like, contents[number], division.exchange.volume[number]);
  }
  for (std::size_t triangle = 0; triangle < part_of.size(); ++triangle) {
    if (part_of[triangle]) {
      division.numbers[triangle / static_cast<std::size_t>(surface_->triangles_per_element)] =
          chamber_of_part[number_of[triangle]];
    }
  }
  return division;
}

/// Of a joined chamber between steps, at the volume that the exchange has.
Chambers::Content Chambers::content(const GasExchange& exchange, int chamber, double time) const {
  const Chamber& self = of(chamber);
  Content gas{first_amount(chamber) + exchange.amount[chamber], 0};
  const double temperature = value_on_key_points(self.options.temperature, time);
  if (self.law == GasLaw::isothermal) {
    gas.heat = gas.amount * temperature;
  } else {
    const double expansion = std::pow(exchange.volume[chamber] / self.initial_volume, 1 - self.gamma);
    gas.heat = (first_amount(chamber) * temperature + exchange.heat[chamber]) * expansion;
  }
  return gas;
}

/// Sets what is in a chamber, or in what will be one. @param like a chamber of its law and reference volume
void Chambers::fill(GasExchange& exchange, int number, int like, const Content& gas, double volume) const {
  const double given = number < count() ? first_amount(number) : 0;
  const double compression = std::pow(volume / of(like).initial_volume, of(like).gamma - 1);
  exchange.volume[number] = volume;
  exchange.amount[number] = gas.amount - given;
  exchange.heat[number] = gas.heat * compression - given * value_on_key_points(of(like).options.temperature, 0);
}

/// Counts gas as leaked if it is on the other side of a chamber's wall from now on, and gives it to what is there.
void Chambers::pass_out(GasExchange& exchange, std::vector<Content>& contents, int chamber, const Content& gas,
                        double heat_capacity) {
  const auto count = [&](int of, double sign) {
    exchange.leak_amount[of] += sign * gas.amount;
    exchange.leak_enthalpy[of] += sign * heat_capacity * gas.heat;
  };
  count(chamber, 1);
  if (exchange.outside[chamber] >= 0) {
    const auto round = static_cast<int>(exchange.inside[static_cast<int>(exchange.outside[chamber])]);
    count(round, -1);
    contents[round].amount += gas.amount;
    contents[round].heat += gas.heat;
  }
}

GasExchange Chambers::recapped(const GasExchange& exchange, const Eigen::VectorXd& walls, double time) const {
  // By how much each wall encloses more than at the end of the last step, from within outwards.
  const Eigen::VectorXd volumes = gas_volumes(walls);
  Eigen::VectorXd more = volumes - exchange.volume;
  const std::vector<int> order = from_within();
  for (const int chamber : order) {
    if (outside(chamber) >= 0) {
      more[outside(chamber)] += more[chamber];
    }
  }
  GasExchange result = exchange;
  if ((more(order).array() == 0).all()) {
    return result;
  }
  std::vector<Content> contents(chambers_.size());
  for (const int chamber : order) {
    contents[chamber] = content(exchange, chamber, time);
  }
  std::vector<bool> is_changed(chambers_.size());
  for (const int chamber : order) {
    const double before = exchange.volume[chamber];
    const double share = -more[chamber] / before;  // that is outside now
    if (!vents(chamber) || is_open(exchange, chamber) || share == 0 || !(before > 0 && volumes[chamber] > 0)) {
      continue;
    }
    Content& gas = contents[chamber];
    const Content moved{share * gas.amount, share * gas.heat};
    gas.amount -= moved.amount;
    gas.heat -= moved.heat;
    pass_out(result, contents, chamber, moved, heat_capacity(chamber));
    if (outside(chamber) < 0) {  // The air comes where the gas was, or goes from there, as in end_step.
      const double by_air = gas_.ambient_pressure * more[chamber];
      result.work[chamber] += by_air;
      result.leak_enthalpy[chamber] -= by_air;
    }
    is_changed[chamber] = true;
    if (outside(chamber) >= 0) {
      is_changed[outside(chamber)] = true;
    }
  }
  for (const int chamber : order) {
    if (is_changed[chamber]) {
      const double volume = is_open(exchange, chamber) ? exchange.volume[chamber] : volumes[chamber];
      fill(result, chamber, chamber, contents[chamber], volume);
    }
  }
  return result;
}

ChamberWalls Chambers::walls(const Field& positions, const Eigen::Vector3d& gravity, double time) const {
  const Eigen::VectorXd area = areas(positions);
  Eigen::VectorXd hole_area = Eigen::VectorXd::Zero(count());
  const std::vector<Rims::Hole> holes = rims_.holes(positions);
  for (const Rims::Hole& hole : holes) {
    hole_area[hole.chamber] += hole.area;
  }
  ChamberWalls result{area, hole_area, {}, Eigen::VectorXd::Zero(count()), Eigen::VectorXd(count())};
  for (int wall = 0; wall < count(); ++wall) {
    const ChamberOptions& options = of(wall).options;
    result.temperature[wall] = options.wall_temperature;
    for (const int side : {inside(wall), outside(wall)}) {
      if (side >= 0) {
        result.conductance[side] += heat_transfer(side) * area[wall];
      }
    }
    if (options.permeability > 0 && inside(wall) != outside(wall)) {
      result.leaks.push_back({inside(wall), options.permeability * area[wall], 0, outside(wall)});
    }
  }
  if (!holes.empty()) {
    const std::vector<UnevenPressure> uneven = uneven_pressures(positions, gravity, time);
    for (const Rims::Hole& hole : holes) {
      if (inside(hole.chamber) != outside(hole.chamber)) {
        result.leaks.push_back({inside(hole.chamber), of(hole.chamber).options.hole_discharge.value_or(0) * hole.area,
                                uneven[hole.chamber].at(hole.middle), outside(hole.chamber)});
      }
    }
  }
  return result;
}

/// Of the walls of all chambers, summed over the ranks [m^2]. Collective.
Eigen::VectorXd Chambers::areas(const Field& positions) const {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(count());
  for (PetscInt triangle = 0; triangle < owned_triangles(); ++triangle) {
    if (const int chamber = of_triangle(triangle); chamber >= 0) {
      const auto& corners = surface_->triangles[triangle];
      sum[chamber] +=
          area_vector(positions.vector(corners[0]), positions.vector(corners[1]), positions.vector(corners[2])).norm();
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, sum.data(), count(), MPI_DOUBLE, MPI_SUM, surface_->comm());
  return sum;
}

/// Of each chamber. Collective.
std::vector<Chambers::UnevenPressure> Chambers::uneven_pressures(const Field& positions, const Eigen::Vector3d& gravity,
                                                                 double time) const {
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(4, count());  // area, area times place
  for (PetscInt triangle = 0; triangle < owned_triangles(); ++triangle) {
    if (const int chamber = of_triangle(triangle); chamber >= 0) {
      const auto& corners = surface_->triangles[triangle];
      const Eigen::Vector3d x[3] = {positions.vector(corners[0]), positions.vector(corners[1]),
                                    positions.vector(corners[2])};
      const double area = area_vector(x[0], x[1], x[2]).norm();
      sums(0, chamber) += area;
      sums.col(chamber).tail<3>() += area / 3 * (x[0] + x[1] + x[2]);
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, sums.data(), static_cast<int>(sums.size()), MPI_DOUBLE, MPI_SUM, surface_->comm());
  const double of_air = gas_.ambient_pressure * gas_.molar_mass / (gas_constant * gas_.ambient_temperature);
  const Eigen::VectorXd volume = gas_volumes(volumes(positions));
  Eigen::VectorXd density(count());
  for (int chamber = 0; chamber < count(); ++chamber) {
    const GasState gas = state(chamber, volume[chamber], time);
    const bool has_amount = gas.amount > 0 && volume[chamber] > 0 && !is_open(chamber);
    density[chamber] = has_amount ? gas.amount * gas_.molar_mass / volume[chamber] : of_air;
  }
  std::vector<UnevenPressure> result;
  for (int wall = 0; wall < count(); ++wall) {
    const double round = outside(wall) >= 0 ? density[outside(wall)] : of_air;
    result.push_back({(density[inside(wall)] - round) * gravity, sums.col(wall).tail<3>() / sums(0, wall)});
  }
  return result;
}

Eigen::Matrix3Xd Chambers::uneven_forces(const Field& positions, const Eigen::Vector3d& gravity, double time) const {
  const std::vector<UnevenPressure> uneven = uneven_pressures(positions, gravity, time);
  Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, surface_->particles.owned);
  for (std::size_t triangle = 0; triangle < surface_->triangles.size(); ++triangle) {
    const int chamber = chamber_of_triangle_[triangle];
    if (chamber < 0) {
      continue;
    }
    const auto& corners = surface_->triangles[triangle];
    const Eigen::Vector3d x[3] = {positions.vector(corners[0]), positions.vector(corners[1]),
                                  positions.vector(corners[2])};
    const Eigen::Vector3d area = area_vector(x[0], x[1], x[2]);
    for (std::size_t k = 0; k < 3; ++k) {
      if (corners[k] < surface_->particles.owned) {  // a linear pressure times the corner's share
        const Eigen::Vector3d place = (x[0] + x[1] + x[2] + x[k]) / 4;
        force.col(corners[k]) += uneven[chamber].at(place) / 3 * area;
      }
    }
  }
  const std::vector<GasState> gas = states(volumes(positions), time);
  Eigen::VectorXd thrust = Eigen::VectorXd::Zero(count());
  for (int wall = 0; wall < count(); ++wall) {
    if (vents(wall)) {  // But for what the missing wall does not bear.
      const double within = gas[inside(wall)].absolute_pressure;
      const double jet = jet_thrust(within, within - gas[wall].pressure, of(wall).gamma);
      thrust[wall] = of(wall).options.hole_discharge.value_or(0) * jet - gas[wall].pressure;
    }
  }
  rims_.add_thrust(thrust, positions, force);
  return force;
}

/// After a change of chamber_of_triangle_.
void Chambers::find_particles() {
  std::vector<std::pair<int, PetscInt>> pairs;  // chamber and particle
  for (std::size_t triangle = 0; triangle < surface_->triangles.size(); ++triangle) {
    for (const PetscInt corner : surface_->triangles[triangle]) {
      if (chamber_of_triangle_[triangle] >= 0 && corner < surface_->particles.owned) {
        pairs.emplace_back(chamber_of_triangle_[triangle], corner);
      }
    }
  }
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  no_gradients_ = Eigen::SparseMatrix<double>(3 * surface_->particles.owned, count());
  no_gradients_.reserve(3 * static_cast<Eigen::Index>(pairs.size()));
  auto pair = pairs.begin();
  for (int chamber = 0; chamber < count(); ++chamber) {
    no_gradients_.startVec(chamber);
    for (; pair != pairs.end() && pair->first == chamber; ++pair) {
      for (int k = 0; k < 3; ++k) {
        no_gradients_.insertBack(3 * pair->second + k, chamber) = 0;
      }
    }
  }
  no_gradients_.finalize();
  place_of_corner_.clear();
  if (count() == 0) {
    return;
  }
  place_of_corner_.reserve(3 * surface_->triangles.size());
  for (std::size_t triangle = 0; triangle < surface_->triangles.size(); ++triangle) {
    const int chamber = chamber_of_triangle_[triangle];
    for (const PetscInt corner : surface_->triangles[triangle]) {
      const bool counts = chamber >= 0 && corner < surface_->particles.owned;
      const auto place = std::lower_bound(pairs.begin(), pairs.end(), std::pair(chamber, corner)) - pairs.begin();
      place_of_corner_.push_back(counts ? static_cast<PetscInt>(place) : -1);
    }
  }
}

Eigen::SparseMatrix<double> Chambers::volume_gradients(const Field& positions) const {
  Eigen::SparseMatrix<double> gradients = no_gradients_;
  Eigen::Map<Eigen::Matrix3Xd> values(gradients.valuePtr(), 3, gradients.nonZeros() / 3);
  for (std::size_t triangle = 0; triangle < surface_->triangles.size(); ++triangle) {
    if (chamber_of_triangle_[triangle] < 0) {
      continue;
    }
    const auto& corners = surface_->triangles[triangle];
    const Eigen::Vector3d third =
        area_vector(positions.vector(corners[0]), positions.vector(corners[1]), positions.vector(corners[2])) / 3;
    for (std::size_t k = 0; k < 3; ++k) {
      if (const PetscInt place = place_of_corner_[3 * triangle + k]; place >= 0) {
        values.col(place) += third;
      }
    }
  }
  return gradients;
}

Eigen::Matrix3Xd Chambers::volume_gradient(int chamber, const Field& positions) const {
  Eigen::Matrix3Xd gradient = Eigen::Matrix3Xd::Zero(3, surface_->particles.owned);
  for (std::size_t triangle = 0; triangle < surface_->triangles.size(); ++triangle) {
    if (chamber_of_triangle_[triangle] != chamber) {
      continue;
    }
    const auto& corners = surface_->triangles[triangle];
    const Eigen::Vector3d third =
        area_vector(positions.vector(corners[0]), positions.vector(corners[1]), positions.vector(corners[2])) / 3;
    for (const PetscInt corner : corners) {
      if (corner < surface_->particles.owned) {
        gradient.col(corner) += third;
      }
    }
  }
  return gradient;
}

GasState Chambers::state(int chamber, double volume, double time) const {
  const Chamber& self = of(chamber);
  const ChamberOptions& given = self.options;
  GasState gas;
  gas.volume = volume;
  if (self.law == GasLaw::volume) {
    return gas;
  }
  if (self.law == GasLaw::pressure) {
    gas.pressure = value_on_key_points(given.pressure, time);
    gas.absolute_pressure = gas.pressure + gas_.ambient_pressure;
    gas.potential = -gas.pressure * volume;
    return gas;
  }

  // Inside: absolute pressure q = (e/V0) (V0/V)^k with its potential, -e ln(V/V0) or e ((V0/V)^(k-1) - 1)/(k-1).
  const bool has_opened = is_joined(chamber) && is_open(chamber);
  const double inside = has_opened ? exchange_.volume[chamber] : volume;
  const double initial_volume = self.initial_volume;
  const double strain = inside > 0 ? std::log(inside / initial_volume) : std::numeric_limits<double>::quiet_NaN();
  double outside = gas_.ambient_pressure;
  double exponent = 1;
  double energy = 0;  // e [J]
  if (self.law == GasLaw::relative) {
    outside = 0;
    energy = value_on_key_points(given.pressure, time) * initial_volume;
  } else {
    const bool adiabatic = self.law == GasLaw::adiabatic;
    const double temperature = value_on_key_points(given.temperature, time);
    exponent = adiabatic ? given.gamma.value_or(default_gamma) : 1;
    const double amount = self.unit_amount * value_on_key_points(given.amount, time);
    double heat = amount * temperature;  // see VesselGas
    gas.amount = amount;
    if (is_joined(chamber)) {
      gas.amount += exchange_.amount[chamber];
      heat = adiabatic ? heat + exchange_.heat[chamber] : gas.amount * temperature;
    }
    gas.temperature = heat / gas.amount * std::exp((1 - exponent) * strain);
    energy = heat * gas_constant;
  }
  if (has_opened) {
    gas.absolute_pressure = outside;
    return gas;
  }
  const double compression = std::expm1((1 - exponent) * strain);  // (V0/V)^(k-1) - 1
  gas.absolute_pressure = energy * (1 + compression) / volume;
  gas.pressure = gas.absolute_pressure - outside;
  gas.pressure_slope = -exponent * gas.absolute_pressure / volume;
  gas.potential =
      (exponent > 1 ? energy * compression / (exponent - 1) : -energy * strain) + outside * (volume - initial_volume);
  return gas;
}

std::vector<GasState> Chambers::states(const Eigen::VectorXd& walls, double time) const {
  const Eigen::VectorXd volumes = gas_volumes(walls);
  std::vector<GasState> states(chambers_.size());
  for (int chamber = 0; chamber < count(); ++chamber) {
    if (inside(chamber) == chamber) {
      states[chamber] = state(chamber, volumes[chamber], time);
    }
  }
  put_across_walls(states);
  return states;
}

void Chambers::put_across_walls(std::vector<GasState>& states) const {
  std::vector<double> pressure;  // against the ambient air
  for (const GasState& gas : states) {
    pressure.push_back(gas.pressure);
  }
  for (int wall = 0; wall < count(); ++wall) {
    const int round = outside(wall);
    states[wall].pressure = pressure[inside(wall)] - (round < 0 ? 0 : pressure[round]);
  }
}

void Chambers::begin_step(const GasExchange& exchange, double h, const ChamberWalls& walls) {
  const bool is_other = exchange.inside != exchange_.inside;
  exchange_ = exchange;
  walls_ = walls;
  h_ = h;
  if (is_other) {
    find_vessels();
  }
}

GasNetwork::Step Chambers::network_step(const Eigen::VectorXd& walls, double time) const {
  GasNetwork::Step step;
  const Eigen::VectorXd volumes = gas_volumes(walls);
  step.volume = volumes(vessels_);
  step.start_volume = (exchange_.volume.array() > 0).select(exchange_.volume, volumes)(vessels_);
  step.temperature.resize(step.volume.size());
  step.time = time;
  step.h = h_;
  for (const int chamber : vessels_) {
    const Chamber& self = of(chamber);
    const double temperature = value_on_key_points(self.options.temperature, time);
    const double amount = first_amount(chamber);
    step.temperature[static_cast<Eigen::Index>(step.gas.size())] = temperature;
    step.gas.push_back({amount + exchange_.amount[chamber], amount * temperature + exchange_.heat[chamber]});
    if (self.law == GasLaw::isothermal) {
      step.gas.back().heat = step.gas.back().amount * temperature;
    }
  }
  for (GasNetwork::Leak leak : walls_.leaks) {
    leak.vessel = vessel_of(leak.vessel);
    leak.outside = leak.outside < 0 ? GasNetwork::ambient : vessel_of(leak.outside);
    step.leaks.push_back(leak);
  }
  if (walls_.conductance.size() > 0) {
    step.conductance = walls_.conductance(vessels_);
    step.wall_temperature = walls_.temperature(vessels_);
  }
  constexpr double wide = 1;  // [m^2]
  for (std::size_t vessel = 0; vessel < vessels_.size(); ++vessel) {
    const int chamber = vessels_[vessel];
    if (is_open(chamber)) {
      step.volume[static_cast<Eigen::Index>(vessel)] = exchange_.volume[chamber];
      step.leaks.push_back({static_cast<int>(vessel), wide, 0});
    }
  }
  return step;
}

GasExchange Chambers::first_exchange(const Eigen::VectorXd& walls) const {
  GasExchange exchange(count(), static_cast<int>(links_.size()));
  exchange.outside = exchange_.outside;
  exchange.volume = gas_volumes(walls);
  for (int chamber = 0; chamber < count(); ++chamber) {
    exchange.reference_volume[chamber] = of(chamber).initial_volume;
    exchange.first_energy[chamber] = energy(chamber, state(chamber, exchange.volume[chamber], 0));
  }
  return exchange;
}

std::string Chambers::imbalance(const Eigen::VectorXd& walls, double time) const {
  constexpr double tolerance = 1e-10;
  // Chambers together with what has been cut off them, and what they have become a part of, listed by the first of
  // them.
  std::vector<int> first(chambers_.size());
  std::iota(first.begin(), first.end(), 0);
  const auto unite = [&](int a, int b) {
    const auto [low, high] = std::minmax(first[a], first[b]);
    std::replace(first.begin(), first.end(), int(high), int(low));
  };
  for (int chamber = 0; chamber < count(); ++chamber) {
    unite(chamber, inside(chamber));
    if (of(chamber).parent >= 0) {
      unite(chamber, of(chamber).parent);
    }
  }
  // Of each: sums that should be 0, and of what they are made.
  Eigen::MatrixXd rest = Eigen::MatrixXd::Zero(2, count());
  Eigen::MatrixXd scale = rest;
  const auto add = [&](int row, int chamber, double value) {
    rest(row, first[chamber]) += value;
    scale(row, first[chamber]) += std::abs(value);
  };
  const std::vector<GasState> gas = states(walls, time);
  for (const int chamber : joined_) {
    add(0, chamber, first_amount(chamber) + exchange_.amount[chamber]);
    add(0, chamber, exchange_.leak_amount[chamber] - first_amount(chamber));
    add(1, chamber, energy(chamber, gas[chamber]));
    for (const double less : {exchange_.first_energy[chamber], exchange_.wall_heat[chamber], -exchange_.work[chamber],
                              -exchange_.leak_enthalpy[chamber]}) {
      add(1, chamber, -less);
    }
  }
  for (std::size_t l = 0; l < links_.size(); ++l) {
    for (const auto& [end, sign] : {std::pair(links_[l].from, 1.0), std::pair(links_[l].to, -1.0)}) {
      if (end >= 0) {
        add(0, end, sign * exchange_.link_amount[static_cast<Eigen::Index>(l)]);
        add(1, end, sign * exchange_.link_enthalpy[static_cast<Eigen::Index>(l)]);
      }
    }
  }
  std::vector<bool> keeps_temperature(chambers_.size());
  for (const int chamber : joined_) {
    if (of(chamber).law == GasLaw::isothermal) {
      keeps_temperature[first[chamber]] = true;
    }
  }
  for (const int chamber : joined_) {
    for (const int row : {0, 1}) {
      if ((row == 0 || !keeps_temperature[chamber]) &&
          !(std::abs(rest(row, chamber)) <= tolerance * scale(row, chamber))) {
        char text[160];
        std::snprintf(text, sizeof text, "the ledger of the %s in chamber %s is off by %.2g %s, expected at most %.2g",
                      row == 0 ? "amount" : "energy", name(chamber).c_str(), rest(row, chamber), row == 0 ? "mol" : "J",
                      tolerance * scale(row, chamber));
        return text;
      }
    }
  }
  return "";
}

/// Absolute, beyond the wall of a joined chamber at the end of a step [Pa].
double Chambers::pressure_round(int chamber, const GasNetwork::End& end) const {
  const int round = outside(chamber);
  return round < 0 ? gas_.ambient_pressure : end.pressure[vessel_of(round)];
}

GasExchange Chambers::end_step(const Eigen::VectorXd& walls, const Eigen::VectorXd& caps, const GasNetwork::Step& step,
                               const GasNetwork::End& end) const {
  constexpr double large_hole = 0.1;
  constexpr double level = 1e-5;
  constexpr double rounding = 1e-10;  // of volumes: changes less than that give no mean pressure
  GasExchange exchange = exchange_;
  const Eigen::VectorXd volumes = gas_volumes(walls);
  exchange.volume = (exchange_.open.array() > 0).select(exchange_.volume, volumes);
  Eigen::VectorXd energy = end.wall_heat - end.leak_enthalpy;  // into each vessel [J]
  for (std::size_t l = 0; l < links_.size(); ++l) {
    const auto row = static_cast<Eigen::Index>(l);
    exchange.link_amount[row] += end.flow[row];
    exchange.link_enthalpy[row] += end.enthalpy[row];
    for (const auto& [chamber, sign] : {std::pair(links_[l].from, -1.0), std::pair(links_[l].to, 1.0)}) {
      if (chamber >= 0) {
        exchange.amount[inside(chamber)] += sign * end.flow[row];
        energy[vessel_of(chamber)] += sign * end.enthalpy[row];
      }
    }
  }
  for (std::size_t v = 0; v < vessels_.size(); ++v) {
    const auto vessel = static_cast<Eigen::Index>(v);
    const int chamber = vessels_[v];
    const Chamber& self = of(chamber);
    const double capacity = heat_capacity(chamber);
    const double heat = step.gas[v].heat;
    exchange.amount[chamber] -= end.leak[vessel];
    exchange.leak_amount[chamber] += end.leak[vessel];
    exchange.leak_enthalpy[chamber] += end.leak_enthalpy[vessel];
    exchange.wall_heat[chamber] += end.wall_heat[vessel];
    const double from = exchange_.volume[chamber];
    const double to = exchange.volume[chamber];
    double work = 0;  // see GasNetwork
    if (self.law == GasLaw::isothermal) {
      work = (heat + end.gas[v].amount * end.temperature[vessel]) / 2 * gas_constant * std::log(to / from);
    } else {
      const auto colder = [&](double volume) { return std::pow(volume / self.initial_volume, 1 - self.gamma); };
      const double middle = colder(std::sqrt(from * to));
      const double more = energy[vessel] / (capacity * middle);
      exchange.heat[chamber] += more;
      work = capacity * (heat * (colder(from) - middle) + (heat + more) * (middle - colder(to)));
    }
    // A cap that moves pushes away the gas beyond it, against the pressure there. This is no work on the wall.
    const double mean = std::abs(to - from) > rounding * from ? work / (to - from) : end.pressure[vessel];
    const double beyond = (mean - pressure_round(chamber, end)) * caps[chamber];
    exchange.work[chamber] += work - beyond;
    exchange.leak_enthalpy[chamber] += beyond;
  }
  for (std::size_t v = 0; v < vessels_.size(); ++v) {
    const int chamber = vessels_[v];
    const int round = outside(chamber);
    const double there = pressure_round(chamber, end);
    const bool is_level = std::abs(end.pressure[static_cast<Eigen::Index>(v)] - there) <= level * gas_.ambient_pressure;
    if (!vents(chamber) || !(walls_.hole_area[chamber] > (is_level ? large_hole : 1) * walls_.area[chamber])) {
      continue;
    }
    if (round < 0) {
      exchange.open[chamber] = 1;
    } else {
      become_part(exchange, chamber, step.time);
    }
  }
  return exchange;
}

/// Gives a chamber's gas to the chamber round it.
void Chambers::become_part(GasExchange& exchange, int chamber, double time) const {
  const auto round = static_cast<int>(exchange.inside[static_cast<int>(exchange.outside[chamber])]);
  const Content own = content(exchange, chamber, time);
  const Content other = content(exchange, round, time);
  const double volume = exchange.volume[chamber] + exchange.volume[round];
  fill(exchange, round, round, {own.amount + other.amount, own.heat + other.heat}, volume);
  fill(exchange, chamber, chamber, {}, 0);
  for (int part = 0; part < count(); ++part) {
    if (exchange.inside[part] == chamber) {
      exchange.inside[part] = round;
    }
  }
}

double Chambers::prescribed_volume(int chamber, double time) const {
  const Chamber& self = of(chamber);
  return self.options.volume.empty() ? self.initial_volume * value_on_key_points(self.options.volume_ratio, time)
                                     : value_on_key_points(self.options.volume, time);
}

}  // namespace gas
}  // namespace pellicle
