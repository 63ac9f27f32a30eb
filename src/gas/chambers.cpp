#include "gas/chambers.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <set>
#include <utility>

#include "base/error.h"
#include "base/units.h"
#include "geometry/key_points.h"
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
  constexpr double any = -std::numeric_limits<double>::infinity();
  static const std::vector<Quantity> all{
      {"pressure", &ChamberOptions::pressure, any, false, {GasLaw::relative, GasLaw::pressure}},
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

void require_valid(const std::string& chamber, const ChamberOptions& options) {
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
    for (const auto& row : rows) {
      if (!(quantity.may_be_lowest ? row[1] >= quantity.lowest : row[1] > quantity.lowest)) {
        throw Error(key + ": " + number_text(row[1]) + " at " + number_text(row[0]) + " s, expected " +
                    (quantity.may_be_lowest ? "at least " : "more than ") + number_text(quantity.lowest));
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
      if (surface.persistent_id[static_cast<std::size_t>(corner)] == vertex) {
        piece = surface.piece[triangle / static_cast<std::size_t>(surface.triangles_per_element)];
      }
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, &piece, 1, MPI_INT, MPI_MAX, surface.comm());
  if (piece < 0) {
    throw Error(chamber + ".vertex: " + std::to_string(vertex) + " is no vertex of the mesh");
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
  std::vector<std::string> taken(static_cast<std::size_t>(surface.pieces()));  // by which chamber
  std::string rest;                                                            // the chamber without a vertex
  for (const auto& [name, given] : options) {
    if (given.vertex < 0) {
      if (!rest.empty()) {
        throw Error("chambers." + name + ".vertex: not given, as for chambers." + rest +
                    ", expected one chamber for the pieces that no other names");
      }
      rest = name;
      continue;
    }
    std::string& owner = taken[static_cast<std::size_t>(piece_of_vertex(surface, "chambers." + name, given.vertex))];
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
                   const Eigen::Vector3d& origin, bool has_symmetry_planes,
                   const std::vector<Eigen::Matrix3d>& projectors)
    : surface_(&surface),
      ambient_pressure_(gas.ambient_pressure),
      ambient_temperature_(gas.ambient_temperature),
      molar_mass_(gas.molar_mass),
      origin_(origin) {
  for (const auto& [name, given] : options) {
    require_valid("chambers." + name, given);
  }
  const NamedPieces named = name_pieces(surface, options);
  for (const auto& [name, given] : named.chambers) {
    add(name, *given);
  }
  for (const int piece : surface.piece) {
    chamber_of_element_.push_back(named.chamber_of_piece[static_cast<std::size_t>(piece)]);
  }
  begin();

  Field rest(surface.particles, 3);
  rest.values() = surface.rest;
  for (std::size_t piece = 0; piece < named.chamber_of_piece.size(); ++piece) {
    const int number = named.chamber_of_piece[piece];
    if (number < 0 || !needs_volume(number)) {
      continue;
    }
    const Chamber& chamber = of(number);
    if (vents(number) && has_symmetry_planes) {
      throw Error("chambers." + chamber.name + ".hole_discharge: does not go with symmetry planes, expected none");
    }
    if (!surface.piece_is_closed[piece] && !vents(number)) {
      if (!has_symmetry_planes) {
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
  set_amounts();
  join(gas);
}

Chambers::Chambers(const Surface& surface, const GasOptions& gas, const std::map<std::string, ChamberOptions>& options,
                   const Eigen::Vector3d& origin, const std::vector<PetscInt>& numbers, const GasExchange* exchange)
    : surface_(&surface),
      ambient_pressure_(gas.ambient_pressure),
      ambient_temperature_(gas.ambient_temperature),
      molar_mass_(gas.molar_mass),
      origin_(origin),
      chamber_of_element_(numbers) {
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
    require_valid("chambers." + name, given);
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
  begin();
  for (PetscInt chamber = 0; exchange != nullptr && chamber <= last; ++chamber) {
    chambers_[static_cast<std::size_t>(chamber)].initial_volume = exchange->reference_volume[chamber];
  }
  set_amounts();
  join(gas);
  if (exchange != nullptr) {
    exchange_ = *exchange;
  }
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
  const Eigen::VectorXd volume = volumes(rest);
  for (std::size_t chamber = 0; chamber < chambers_.size(); ++chamber) {
    chambers_[chamber].initial_volume = volume[static_cast<Eigen::Index>(chamber)];
  }
}

/// What the laws need that the options have not.
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
      if (!(ambient_pressure_ > 0)) {
        throw Error("chambers." + chamber.name +
                    ".amount: not given, expected n in mol where gas.ambient_pressure is 0");
      }
      given.amount = given.amount_ratio.empty() ? Rows{{0, 1}} : given.amount_ratio;
      chamber.unit_amount =
          ambient_pressure_ * chamber.initial_volume / (gas_constant * value_on_key_points(given.temperature, 0));
    }
  }
}

/// The network of what links and heat join.
void Chambers::join(const GasOptions& gas) {
  exchange_ = GasExchange(count(), static_cast<int>(gas.links.size()));
  vessel_of_.assign(chambers_.size(), -1);
  std::vector<GasNetwork::Vessel> vessels;
  const auto vessel_of = [&](std::size_t chamber, const std::string& key) {
    int& number = vessel_of_[chamber];
    if (number >= 0) {
      return number;
    }
    const Chamber& self = chambers_[chamber];
    if (self.law != GasLaw::isothermal && self.law != GasLaw::adiabatic) {
      throw Error(key + ": chamber " + self.name + " has the law " + self.options.law.name() +
                  ", expected isothermal or adiabatic, by which it has an amount of gas");
    }
    if (self.options.amount.size() > 1) {
      throw Error(key + ": the amount in chamber " + self.name + " is given in " +
                  std::to_string(self.options.amount.size()) +
                  " key points, expected one, the amount at first: links change it");
    }
    if (!(self.options.amount.front()[1] > 0) && self.parent < 0) {
      throw Error(key + ": there is no gas in chamber " + self.name + " at first, expected an amount above 0");
    }
    number = static_cast<int>(vessels.size());
    joined_.push_back(static_cast<int>(chamber));
    vessels.push_back({self.name, self.law == GasLaw::isothermal, self.gamma, self.initial_volume});
    return number;
  };
  const auto end_of = [&](const std::string& name, const std::string& key) {
    if (name.empty() || name == "ambient") {
      return GasNetwork::ambient;
    }
    const auto found =
        std::find_if(chambers_.begin(), chambers_.end(), [&](const Chamber& chamber) { return chamber.name == name; });
    if (found == chambers_.end()) {
      std::string names;
      for (const Chamber& chamber : chambers_) {
        names += (names.empty() ? "" : ", ") + chamber.name;
      }
      throw Error(key + ": there is no chamber " + name + ", expected " + (names.empty() ? "chambers" : names) +
                  " or ambient");
    }
    return vessel_of(static_cast<std::size_t>(found - chambers_.begin()), key);
  };
  std::vector<GasNetwork::Link> links;
  for (const auto& [name, options] : gas.links) {
    const std::string key = "gas_network.links." + name;
    links.push_back({name, end_of(options.from, key + ".from"), end_of(options.to, key + ".to"), options});
  }
  for (std::size_t chamber = 0; chamber < chambers_.size(); ++chamber) {
    const ChamberOptions& options = chambers_[chamber].options;
    const std::string key = "chambers." + chambers_[chamber].name;
    if (options.heat_transfer > 0) {
      vessel_of(chamber, key + ".heat_transfer");
    } else if (options.permeability > 0) {
      vessel_of(chamber, key + ".permeability");
    } else if (options.hole_discharge) {
      vessel_of(chamber, key + ".hole_discharge");
    }
  }
  network_ = GasNetwork(std::move(vessels), std::move(links), gas);
}

void Chambers::require_closed(int chamber, const Field& rest, const std::vector<Eigen::Matrix3d>& projectors) const {
  // The triangles that close the piece join the edges of its boundary to the origin. They lie in the planes if what
  // they add to the derivative of the volume, by a vertex that may not leave its planes, is not felt by it.
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
      has_hole_[static_cast<std::size_t>(chamber)] = 1;
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
    rims_ = Rims(*surface_, venting);
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
    if (const int chamber = chamber_of_triangle[static_cast<std::size_t>(triangle)]; chamber >= 0) {
      const auto& corners = surface_->triangles[static_cast<std::size_t>(triangle)];
      sum[chamber] += enclosed_volume(positions.vector(corners[0]) - origin_, positions.vector(corners[1]) - origin_,
                                      positions.vector(corners[2]) - origin_);
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, sum.data(), count, MPI_DOUBLE, MPI_SUM, surface_->comm());
  rims.add_volumes(positions, origin_, sum);
  return sum;
}

void GasExchange::add_part(int chamber) {
  const Eigen::Index count = parent.size() + 1;
  for (Eigen::VectorXd* values :
       {&amount, &heat, &open, &leak_amount, &leak_enthalpy, &wall_heat, &work, &first_energy, &volume}) {
    values->conservativeResizeLike(Eigen::VectorXd::Zero(count));
  }
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
    const PetscInt here = piece[static_cast<std::size_t>(surface_->triangles[triangle].front())];
    if (chamber >= 0 && vents(chamber) && exchange.open[chamber] == 0 && here >= 0) {
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
  const Eigen::VectorXd volume_of =
      volumes(positions, number_of, Rims(*surface_, number_of), static_cast<int>(parts.size()));
  const Eigen::VectorXd volume = volumes(positions);

  Division division{chamber_of_element_, exchange, {}};
  std::vector<int> chamber_of_part(parts.size(), -1);
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
    const GasState gas = state(chamber, whole, time);
    double kept = 0;  // [mol]
    std::string line = "chamber " + name(chamber) + " is cut in " + std::to_string(large.size()) + " of";
    for (const std::size_t part : large) {
      int& number = chamber_of_part[part];
      if (number < 0) {
        number = static_cast<int>(division.exchange.parent.size());
        division.exchange.add_part(chamber);
      }
      const double enclosed = volume_of[static_cast<Eigen::Index>(part)];
      const double amount = gas.amount * enclosed / whole;
      kept += amount;
      fill(division.exchange, number, chamber, amount, gas.temperature, enclosed);
      char text[32];
      std::snprintf(text, sizeof text, "%s %.4g m^3", part == large.front() ? "" : ",", enclosed);
      line += text;
    }
    leak(division.exchange, chamber, gas.amount - kept, gas.temperature);
    division.lines.push_back(line);
  }
  for (std::size_t triangle = 0; triangle < part_of.size(); ++triangle) {
    if (part_of[triangle]) {
      division.numbers[triangle / static_cast<std::size_t>(surface_->triangles_per_element)] =
          chamber_of_part[static_cast<std::size_t>(number_of[triangle])];
    }
  }
  return division;
}

/// Sets what is in a chamber, or in what will be one. @param like a chamber of its law and reference volume
void Chambers::fill(GasExchange& exchange, int number, int like, double amount, double temperature,
                    double volume) const {
  const double given = number < count() ? first_amount(number) : 0;
  const double compression = std::pow(volume / of(like).initial_volume, of(like).gamma - 1);
  exchange.volume[number] = volume;
  exchange.amount[number] = amount - given;
  exchange.heat[number] =
      amount * temperature * compression - given * value_on_key_points(of(like).options.temperature, 0);
}

/// Counts gas as leaked that is outside from now on.
void Chambers::leak(GasExchange& exchange, int chamber, double amount, double temperature) const {
  exchange.leak_amount[chamber] += amount;
  exchange.leak_enthalpy[chamber] += heat_capacity(chamber) * amount * temperature;
}

GasExchange Chambers::recapped(const GasExchange& exchange, const Eigen::VectorXd& volumes, double time) const {
  GasExchange result = exchange;
  for (const int chamber : joined_) {
    const double before = exchange.volume[chamber];
    if (vents(chamber) && !is_open(exchange, chamber) && before > 0 && volumes[chamber] > 0) {
      const GasState gas = state(chamber, before, time);
      const double amount = gas.amount * volumes[chamber] / before;
      fill(result, chamber, chamber, amount, gas.temperature, volumes[chamber]);
      leak(result, chamber, gas.amount - amount, gas.temperature);
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
  ChamberWalls result{area, hole_area, {}, Eigen::VectorXd(count()), Eigen::VectorXd(count())};
  for (int chamber = 0; chamber < count(); ++chamber) {
    const ChamberOptions& options = of(chamber).options;
    if (options.permeability > 0) {
      result.leaks.push_back({chamber, options.permeability * area[chamber], 0});
    }
    result.conductance[chamber] = options.heat_transfer * area[chamber];
    result.temperature[chamber] = options.wall_temperature;
  }
  if (!holes.empty()) {
    const std::vector<UnevenPressure> uneven = uneven_pressures(positions, gravity, time);
    for (const Rims::Hole& hole : holes) {
      result.leaks.push_back({hole.chamber, of(hole.chamber).options.hole_discharge.value_or(0) * hole.area,
                              uneven[static_cast<std::size_t>(hole.chamber)].at(hole.middle)});
    }
  }
  return result;
}

/// Of the walls of all chambers, summed over the ranks [m^2]. Collective.
Eigen::VectorXd Chambers::areas(const Field& positions) const {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(count());
  for (PetscInt triangle = 0; triangle < owned_triangles(); ++triangle) {
    if (const int chamber = of_triangle(triangle); chamber >= 0) {
      const auto& corners = surface_->triangles[static_cast<std::size_t>(triangle)];
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
  const Eigen::VectorXd volume = volumes(positions);
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(4, count());  // area, area times place
  for (PetscInt triangle = 0; triangle < owned_triangles(); ++triangle) {
    if (const int chamber = of_triangle(triangle); chamber >= 0) {
      const auto& corners = surface_->triangles[static_cast<std::size_t>(triangle)];
      const Eigen::Vector3d x[3] = {positions.vector(corners[0]), positions.vector(corners[1]),
                                    positions.vector(corners[2])};
      const double area = area_vector(x[0], x[1], x[2]).norm();
      sums(0, chamber) += area;
      sums.col(chamber).tail<3>() += area / 3 * (x[0] + x[1] + x[2]);
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, sums.data(), static_cast<int>(sums.size()), MPI_DOUBLE, MPI_SUM, surface_->comm());
  const double outside = ambient_pressure_ * molar_mass_ / (gas_constant * ambient_temperature_);
  std::vector<UnevenPressure> result;
  for (int chamber = 0; chamber < count(); ++chamber) {
    const GasState gas = state(chamber, volume[chamber], time);
    const bool has_amount = gas.amount > 0 && volume[chamber] > 0 && !is_open(chamber);
    const double density = has_amount ? gas.amount * molar_mass_ / volume[chamber] : outside;
    result.push_back({(density - outside) * gravity, sums.col(chamber).tail<3>() / sums(0, chamber)});
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
        force.col(corners[k]) += uneven[static_cast<std::size_t>(chamber)].at(place) / 3 * area;
      }
    }
  }
  const Eigen::VectorXd volume = volumes(positions);
  Eigen::VectorXd thrust = Eigen::VectorXd::Zero(count());
  for (int chamber = 0; chamber < count(); ++chamber) {
    if (vents(chamber)) {
      // But for what the missing wall does not bear.
      const double pressure = state(chamber, volume[chamber], time).absolute_pressure;
      thrust[chamber] =
          of(chamber).options.hole_discharge.value_or(0) * jet_thrust(pressure, ambient_pressure_, of(chamber).gamma) -
          (pressure - ambient_pressure_);
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
    gas.absolute_pressure = gas.pressure + ambient_pressure_;
    gas.potential = -gas.pressure * volume;
    return gas;
  }

  // Inside: absolute pressure q = (e/V0) (V0/V)^k with its potential, -e ln(V/V0) or e ((V0/V)^(k-1) - 1)/(k-1).
  const bool has_opened = is_joined(chamber) && is_open(chamber);
  const double inside = has_opened ? exchange_.volume[chamber] : volume;
  const double initial_volume = self.initial_volume;
  const double strain = inside > 0 ? std::log(inside / initial_volume) : std::numeric_limits<double>::quiet_NaN();
  double outside = ambient_pressure_;
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

void Chambers::begin_step(const GasExchange& exchange, double h, const ChamberWalls& walls) {
  exchange_ = exchange;
  walls_ = walls;
  h_ = h;
}

GasNetwork::Step Chambers::network_step(const Eigen::VectorXd& volumes, double time) const {
  GasNetwork::Step step;
  step.volume = volumes(joined_);
  step.temperature.resize(network_.count());
  step.time = time;
  step.h = h_;
  for (const int chamber : joined_) {
    const Chamber& self = of(chamber);
    const double temperature = value_on_key_points(self.options.temperature, time);
    const double amount = first_amount(chamber);
    step.temperature[static_cast<Eigen::Index>(step.gas.size())] = temperature;
    step.gas.push_back({amount + exchange_.amount[chamber], amount * temperature + exchange_.heat[chamber]});
    if (self.law == GasLaw::isothermal) {
      step.gas.back().heat = step.gas.back().amount * temperature;
    }
  }
  for (const GasNetwork::Leak& leak : walls_.leaks) {
    step.leaks.push_back({vessel_of_[static_cast<std::size_t>(leak.vessel)], leak.area, leak.rise});
  }
  if (walls_.conductance.size() > 0) {
    step.conductance = walls_.conductance(joined_);
    step.wall_temperature = walls_.temperature(joined_);
  }
  constexpr double wide = 1;  // [m^2]
  for (int vessel = 0; vessel < network_.count(); ++vessel) {
    const int chamber = joined_[static_cast<std::size_t>(vessel)];
    if (is_open(chamber)) {
      step.volume[vessel] = exchange_.volume[chamber];
      step.leaks.push_back({vessel, wide, 0});
    }
  }
  return step;
}

std::vector<GasState> Chambers::end_states(const Eigen::VectorXd& volumes, double time) const {
  std::vector<GasState> states;
  for (int chamber = 0; chamber < count(); ++chamber) {
    states.push_back(state(chamber, volumes[chamber], time));
  }
  if (!has_network() || !(volumes(joined_).minCoeff() > 0)) {
    return states;
  }
  const GasNetwork::End end = network_.solve(network_step(volumes, time));
  for (int vessel = 0; vessel < network_.count(); ++vessel) {
    GasState& gas = states[static_cast<std::size_t>(joined_[static_cast<std::size_t>(vessel)])];
    gas.absolute_pressure = end.pressure[vessel];
    gas.pressure = is_open(joined_[static_cast<std::size_t>(vessel)]) ? 0 : end.pressure[vessel] - ambient_pressure_;
    gas.amount = end.gas[static_cast<std::size_t>(vessel)].amount;
    gas.temperature = end.temperature[vessel];
  }
  return states;
}

Eigen::MatrixXd Chambers::joined_slopes(const Eigen::VectorXd& volumes, double time) const {
  const GasNetwork::Step step = network_step(volumes, time);
  Eigen::MatrixXd slopes = network_.slopes(step, network_.solve(step));
  for (int vessel = 0; vessel < network_.count(); ++vessel) {
    if (is_open(joined_[static_cast<std::size_t>(vessel)])) {
      slopes.row(vessel).setZero();
      slopes.col(vessel).setZero();
    }
  }
  return slopes;
}

double Chambers::joined_work(const Eigen::VectorXd& from, const Eigen::VectorXd& to, double time) const {
  // Gauss's rule with four points: places in (0, 1) and weights.
  static const std::array<double, 4> places{0.06943184420297371, 0.33000947820757187, 0.6699905217924281,
                                            0.9305681557970262};
  static const std::array<double, 4> weights{0.17392742256872692, 0.32607257743127307, 0.32607257743127307,
                                             0.17392742256872692};
  double work = 0;
  for (std::size_t k = 0; k < places.size(); ++k) {
    const std::vector<GasState> states = end_states(from + places[k] * (to - from), time);
    for (const int chamber : joined_) {
      work += weights[k] * states[static_cast<std::size_t>(chamber)].pressure * (to[chamber] - from[chamber]);
    }
  }
  return work;
}

GasExchange Chambers::first_exchange(const Eigen::VectorXd& volumes) const {
  GasExchange exchange(count(), static_cast<int>(network_.links().size()));
  exchange.volume = volumes;
  for (int chamber = 0; chamber < count(); ++chamber) {
    exchange.reference_volume[chamber] = of(chamber).initial_volume;
    exchange.first_energy[chamber] = energy(chamber, state(chamber, volumes[chamber], 0));
  }
  return exchange;
}

std::string Chambers::imbalance(const Eigen::VectorXd& volumes, double time) const {
  constexpr double tolerance = 1e-10;
  // Of each chamber with what has been cut off it: sums that should be 0, and of what they are made.
  Eigen::MatrixXd rest = Eigen::MatrixXd::Zero(2, count());
  Eigen::MatrixXd scale = rest;
  const auto add = [&](int row, int chamber, double value) {
    while (of(chamber).parent >= 0) {
      chamber = of(chamber).parent;
    }
    rest(row, chamber) += value;
    scale(row, chamber) += std::abs(value);
  };
  for (const int chamber : joined_) {
    add(0, chamber, first_amount(chamber) + exchange_.amount[chamber]);
    add(0, chamber, exchange_.leak_amount[chamber] - first_amount(chamber));
    add(1, chamber, energy(chamber, state(chamber, volumes[chamber], time)));
    for (const double less : {exchange_.first_energy[chamber], exchange_.wall_heat[chamber], -exchange_.work[chamber],
                              -exchange_.leak_enthalpy[chamber]}) {
      add(1, chamber, -less);
    }
  }
  for (std::size_t l = 0; l < network_.links().size(); ++l) {
    const GasNetwork::Link& link = network_.links()[l];
    for (const auto& [vessel, sign] : {std::pair(link.from, 1.0), std::pair(link.to, -1.0)}) {
      if (vessel != GasNetwork::ambient) {
        const int chamber = joined_[static_cast<std::size_t>(vessel)];
        add(0, chamber, sign * exchange_.link_amount[static_cast<Eigen::Index>(l)]);
        add(1, chamber, sign * exchange_.link_enthalpy[static_cast<Eigen::Index>(l)]);
      }
    }
  }
  for (const int chamber : joined_) {
    const bool keeps_temperature = of(chamber).law == GasLaw::isothermal;
    for (const int row : {0, 1}) {
      if ((row == 0 || !keeps_temperature) && !(std::abs(rest(row, chamber)) <= tolerance * scale(row, chamber))) {
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

GasExchange Chambers::end_step(const Eigen::VectorXd& end, double time) const {
  constexpr double large_hole = 0.1;
  constexpr double level = 1e-5;
  GasExchange exchange = exchange_;
  exchange.volume = (exchange_.open.array() > 0).select(exchange_.volume, end);
  const GasNetwork::Step step = network_step(end, time);
  const GasNetwork::End ended = network_.solve(step);
  Eigen::VectorXd energy = ended.wall_heat - ended.leak_enthalpy;  // into each vessel [J]
  for (std::size_t l = 0; l < network_.links().size(); ++l) {
    const GasNetwork::Link& link = network_.links()[l];
    const auto row = static_cast<Eigen::Index>(l);
    exchange.link_amount[row] += ended.flow[row];
    exchange.link_enthalpy[row] += ended.enthalpy[row];
    for (const auto& [vessel, sign] : {std::pair(link.from, -1.0), std::pair(link.to, 1.0)}) {
      if (vessel != GasNetwork::ambient) {
        exchange.amount[joined_[static_cast<std::size_t>(vessel)]] += sign * ended.flow[row];
        energy[vessel] += sign * ended.enthalpy[row];
      }
    }
  }
  for (int vessel = 0; vessel < network_.count(); ++vessel) {
    const int chamber = joined_[static_cast<std::size_t>(vessel)];
    const Chamber& self = of(chamber);
    const double capacity = network_.heat_capacity(vessel);
    const double heat = step.gas[static_cast<std::size_t>(vessel)].heat;
    exchange.amount[chamber] -= ended.leak[vessel];
    exchange.leak_amount[chamber] += ended.leak[vessel];
    exchange.leak_enthalpy[chamber] += ended.leak_enthalpy[vessel];
    exchange.wall_heat[chamber] += ended.wall_heat[vessel];
    const double from = exchange_.volume[chamber];
    const double to = exchange.volume[chamber];
    const bool is_level = std::abs(ended.pressure[vessel] - ambient_pressure_) <= level * ambient_pressure_;
    if (vents(chamber) && walls_.hole_area[chamber] > (is_level ? large_hole : 1) * walls_.area[chamber]) {
      exchange.open[chamber] = 1;
    }
    if (self.law == GasLaw::isothermal) {
      exchange.work[chamber] += heat * gas_constant * std::log(to / from);
      continue;
    }
    const auto colder = [&](double volume) { return std::pow(volume / self.initial_volume, 1 - self.gamma); };
    exchange.heat[chamber] += energy[vessel] / (capacity * colder(to));
    exchange.work[chamber] += capacity * heat * (colder(from) - colder(to));
  }
  return exchange;
}

std::vector<GasState> Chambers::moved_states(const Eigen::VectorXd& volumes, const Eigen::VectorXd& compliance,
                                             double time) const {
  std::vector<GasState> states;
  for (int chamber = 0; chamber < count(); ++chamber) {
    states.push_back(moved_state(chamber, volumes[chamber], compliance[chamber], time));
  }
  if (!has_network()) {
    return states;
  }
  // The same for the joined ones together, from where they would be without their links.
  Eigen::VectorXd at(count());
  for (int chamber = 0; chamber < count(); ++chamber) {
    at[chamber] = states[static_cast<std::size_t>(chamber)].volume;
  }
  constexpr int most_iterations = 50;
  constexpr double tolerance = 1e-12;
  for (int iteration = 0; iteration < most_iterations; ++iteration) {
    const std::vector<GasState> joined = end_states(at, time);
    Eigen::VectorXd excess(network_.count());
    for (int vessel = 0; vessel < network_.count(); ++vessel) {
      const int chamber = joined_[static_cast<std::size_t>(vessel)];
      states[static_cast<std::size_t>(chamber)] = joined[static_cast<std::size_t>(chamber)];
      excess[vessel] =
          at[chamber] - volumes[chamber] - compliance[chamber] * joined[static_cast<std::size_t>(chamber)].pressure;
    }
    if (!(excess.cwiseQuotient(at(joined_)).cwiseAbs().maxCoeff() > tolerance)) {
      break;
    }
    const Eigen::MatrixXd slopes = joined_slopes(at, time);
    const Eigen::MatrixXd derivative =
        Eigen::MatrixXd::Identity(network_.count(), network_.count()) - compliance(joined_).asDiagonal() * slopes;
    const Eigen::VectorXd step = derivative.partialPivLu().solve(excess);
    at(joined_) = (at(joined_) - step).cwiseMax(at(joined_) / 2).eval();
  }
  return states;
}

GasState Chambers::moved_state(int chamber, double volume, double compliance, double time) const {
  if (prescribes_volume(chamber)) {
    GasState gas;
    gas.volume = prescribed_volume(chamber, time);
    gas.pressure = compliance > 0 ? (gas.volume - volume) / compliance : 0;
    return gas;
  }
  if (!needs_volume(chamber)) {
    return state(chamber, volume, time);
  }
  // V - volume - compliance p(V) rises and is concave: Newton's method goes up to its zero, once it is below.
  GasState gas = state(chamber, volume > 0 ? volume : of(chamber).initial_volume, time);
  constexpr int most_iterations = 200;
  constexpr double tolerance = 1e-14;
  for (int iteration = 0; iteration < most_iterations; ++iteration) {
    const double excess = gas.volume - volume - compliance * gas.pressure;
    const double step = -excess / (1 - compliance * gas.pressure_slope);
    if (std::abs(step) <= tolerance * gas.volume) {
      break;
    }
    gas = state(chamber, std::max(gas.volume + step, gas.volume / 2), time);
  }
  return gas;
}

double Chambers::prescribed_volume(int chamber, double time) const {
  const Chamber& self = of(chamber);
  return self.options.volume.empty() ? self.initial_volume * value_on_key_points(self.options.volume_ratio, time)
                                     : value_on_key_points(self.options.volume, time);
}

}  // namespace gas
}  // namespace pellicle
