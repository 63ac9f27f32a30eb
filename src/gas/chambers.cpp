#include "gas/chambers.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/error.h"
#include "base/units.h"
#include "geometry/key_points.h"
#include "geometry/pressure_load.h"

namespace pellicle {
inline namespace gas {

namespace {

constexpr double gas_constant = 8.31446261815324;  ///< R [J/(mol K)], exact
constexpr double default_temperature = 293.15;     // [K]
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
    : surface_(&surface), ambient_pressure_(gas.ambient_pressure), origin_(origin) {
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
    if (number < 0 || !needs_closed_wall(number)) {
      continue;
    }
    const Chamber& chamber = of(number);
    if (!surface.piece_is_closed[piece]) {
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
}

Chambers::Chambers(const Surface& surface, const GasOptions& gas, const std::map<std::string, ChamberOptions>& options,
                   const Eigen::Vector3d& origin, const std::vector<PetscInt>& numbers)
    : surface_(&surface), ambient_pressure_(gas.ambient_pressure), origin_(origin), chamber_of_element_(numbers) {
  PetscInt last = -1;
  for (const PetscInt number : numbers) {
    last = std::max(last, number);
  }
  MPI_Allreduce(MPI_IN_PLACE, &last, 1, MPIU_INT, MPI_MAX, surface.comm());
  const auto with_vertex =
      std::count_if(options.begin(), options.end(), [](const auto& chamber) { return chamber.second.vertex >= 0; });
  for (const auto& [name, given] : options) {
    require_valid("chambers." + name, given);
    const auto pieces = given.vertex < 0 ? static_cast<int>(last + 1 - with_vertex) : 1;
    for (int piece = 1; piece <= pieces; ++piece) {
      add(name_of(name, piece), given);
    }
  }
  begin();
  set_amounts();
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
  chamber_of_triangle_.assign(living.triangles.size(), -1);
  has_hole_.assign(chambers_.size(), 0);
  const auto per_element = static_cast<std::size_t>(surface_->triangles_per_element);
  const auto open = [this](PetscInt chamber) {
    if (chamber >= 0 && !needs_closed_wall(static_cast<int>(chamber))) {
      has_hole_[static_cast<std::size_t>(chamber)] = 1;
    }
  };
  for (std::size_t triangle = 0; triangle < living.triangles.size(); ++triangle) {
    const PetscInt chamber = chamber_of_element_[triangle / per_element];
    if (living.triangles[triangle] || (chamber >= 0 && needs_closed_wall(static_cast<int>(chamber)))) {
      chamber_of_triangle_[triangle] = static_cast<int>(chamber);
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
}

Eigen::VectorXd Chambers::volumes(const Field& positions) const {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(count());
  for (PetscInt triangle = 0; triangle < surface_->triangles_per_element * surface_->elements.owned; ++triangle) {
    if (const int chamber = of_triangle(triangle); chamber >= 0) {
      const auto& corners = surface_->triangles[static_cast<std::size_t>(triangle)];
      sum[chamber] += enclosed_volume(positions.vector(corners[0]) - origin_, positions.vector(corners[1]) - origin_,
                                      positions.vector(corners[2]) - origin_);
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, sum.data(), count(), MPI_DOUBLE, MPI_SUM, surface_->comm());
  return sum;
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
  const double initial_volume = self.initial_volume;
  const double strain = volume > 0 ? std::log(volume / initial_volume) : std::numeric_limits<double>::quiet_NaN();
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
    gas.amount = self.unit_amount * value_on_key_points(given.amount, time);
    gas.temperature = temperature * std::exp((1 - exponent) * strain);
    energy = gas.amount * gas_constant * temperature;
  }
  const double compression = std::expm1((1 - exponent) * strain);  // (V0/V)^(k-1) - 1
  gas.absolute_pressure = energy * (1 + compression) / volume;
  gas.pressure = gas.absolute_pressure - outside;
  gas.pressure_slope = -exponent * gas.absolute_pressure / volume;
  gas.potential =
      (exponent > 1 ? energy * compression / (exponent - 1) : -energy * strain) + outside * (volume - initial_volume);
  return gas;
}

GasState Chambers::moved_state(int chamber, double volume, double compliance, double time) const {
  if (prescribes_volume(chamber)) {
    GasState gas;
    gas.volume = prescribed_volume(chamber, time);
    gas.pressure = compliance > 0 ? (gas.volume - volume) / compliance : 0;
    return gas;
  }
  if (!needs_closed_wall(chamber)) {
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
