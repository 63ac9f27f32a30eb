#include "gas/chamber_keys.h"

#include <algorithm>
#include <cstddef>

#include "base/error.h"
#include "base/units.h"
#include "geometry/key_points.h"
#include "parallel/collective.h"

namespace pellicle::gas {

namespace {

/// Key points of a chamber: their key, whether they may be 0, the laws that use them.
struct Quantity {
  const char* key;
  Rows ChamberOptions::*rows;
  bool may_be_zero;
  std::vector<GasLaw> laws;
};

[[noreturn]] void refuse_for_law(const std::string& key, const std::string& law) {
  throw Error(key + ": given, but the law " + law + " does not use it, expected another law or no such key");
}

/// The piece to which a vertex belongs. Collective.
int piece_of_vertex(const Surface& surface, const std::string& chamber, int vertex) {
  int piece = -1;
  for (std::size_t triangle = 0; triangle < surface.triangles.size(); ++triangle) {
    for (const PetscInt corner : surface.triangles[triangle]) {
      if (surface.persistent_id[corner] == vertex) {
        piece = surface.piece[surface.element_of_triangle(triangle)];
      }
    }
  }
  piece = max_over_ranks(surface.comm(), piece);
  if (piece < 0) {
    throw Error(chamber + ".vertex: " + std::to_string(vertex) + " is no vertex of the mesh, expected one of it");
  }
  return piece;
}

}  // namespace

void require_key_points(const std::string& key, const Rows& rows, const std::function<bool(double)>& is_valid,
                        const std::string& expected) {
  if (const std::string fault = fault_of_key_points(rows, {"time", "value"}); !fault.empty()) {
    throw Error(key + ": " + fault);
  }
  for (const auto& row : rows) {
    if (!is_valid(row[1])) {
      throw Error(key + ": " + number_text(row[1]) + " at " + number_text(row[0]) + " s, expected " + expected);
    }
  }
}

void require_valid_chamber(const std::string& chamber, const ChamberOptions& options, double ambient_pressure) {
  static const std::vector<Quantity> quantities{
      {"pressure", &ChamberOptions::pressure, true, {GasLaw::relative, GasLaw::pressure}},
      {"amount", &ChamberOptions::amount, true, {GasLaw::isothermal, GasLaw::adiabatic}},
      {"amount_ratio", &ChamberOptions::amount_ratio, true, {GasLaw::isothermal, GasLaw::adiabatic}},
      {"temperature", &ChamberOptions::temperature, false, {GasLaw::isothermal, GasLaw::adiabatic}},
      {"volume_ratio", &ChamberOptions::volume_ratio, false, {GasLaw::volume}},
      {"volume", &ChamberOptions::volume, false, {GasLaw::volume}}};
  for (const Quantity& quantity : quantities) {
    const Rows& rows = options.*quantity.rows;
    const std::string key = chamber + "." + quantity.key;
    if (rows.empty()) {
      continue;
    }
    if (std::find(quantity.laws.begin(), quantity.laws.end(), GasLaw(options.law)) == quantity.laws.end()) {
      refuse_for_law(key, options.law.name());
    }
    const bool is_gauge = &rows == &options.pressure && options.law == GasLaw::pressure;
    const double lowest = is_gauge ? -ambient_pressure : 0;
    require_key_points(
        key, rows, [&](double value) { return quantity.may_be_zero ? value >= lowest : value > lowest; },
        (quantity.may_be_zero ? "at least " : "more than ") + number_text(lowest) +
            (is_gauge ? ", a vacuum inside where gas.ambient_pressure is outside" : ""));
  }
  if (options.gamma && options.law != GasLaw::adiabatic) {
    refuse_for_law(chamber + ".gamma", options.law.name());
  }
  if (options.law == GasLaw::adiabatic && options.temperature.size() > 1) {
    throw Error(chamber + ".temperature: " + std::to_string(options.temperature.size()) +
                " key points, expected one with the law adiabatic: the temperature at the undeformed volume");
  }
  const auto refuse_if = [&](bool is_wrong, const std::string& pair) {
    if (is_wrong) {
      throw Error(chamber + ": " + pair + " given, expected one of them");
    }
  };
  refuse_if(!options.amount.empty() && !options.amount_ratio.empty(), "both amount and amount_ratio");
  refuse_if(!options.volume.empty() && !options.volume_ratio.empty(), "both volume and volume_ratio");
  refuse_if(options.law == GasLaw::volume && options.volume.empty() && options.volume_ratio.empty(),
            "neither volume nor volume_ratio");
  if ((options.law == GasLaw::relative || options.law == GasLaw::pressure) && options.pressure.empty()) {
    throw Error(chamber + ".pressure: not given, expected key points (time, pressure) with the law " +
                options.law.name());
  }
}

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
        result.chambers.emplace_back(name_of_piece(name, found), &given);
      }
    }
    if (found == 0) {
      throw Error("chambers." + name + ": other chambers name all pieces of the mesh, expected a piece for it");
    }
  }
  return result;
}

}  // namespace pellicle::gas
