#pragma once

#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "gas/gas_options.h"
#include "surface/surface.h"

namespace pellicle::gas {

constexpr double default_temperature = 293.15;  ///< of a chamber's gas [K]
constexpr double default_gamma = 1.4;           ///< ratio of the heat capacities of an adiabatic gas

/// Checks key points (time, value). @param is_valid whether a value is what is `expected`, in words
/// @throws Error that names the key
void require_key_points(const std::string& key, const Rows& rows, const std::function<bool(double)>& is_valid,
                        const std::string& expected);

/// Checks the keys of a chamber against its law. @param chamber its key in the deck
/// @param ambient_pressure [Pa], by which a gauge pressure may be below 0
/// @throws Error on keys that the law lacks or does not use, and on values out of range
void require_valid_chamber(const std::string& chamber, const ChamberOptions& options, double ambient_pressure);

/// The chamber of each piece of a surface, and the names and options of the chambers in their order.
struct NamedPieces {
  std::vector<int> chamber_of_piece;  ///< -1: none
  std::vector<std::pair<std::string, const ChamberOptions*>> chambers;
};

/// The name of a chamber that stands for several pieces. @param piece from 1 on
inline std::string name_of_piece(const std::string& name, int piece) {
  return piece == 1 ? name : name + "_" + std::to_string(piece);
}

/// Assigns the pieces of a surface to chambers by the vertices that the options name; a chamber without a vertex gets
/// the remaining pieces. Collective. @throws Error on vertices that the mesh lacks and pieces in two chambers
NamedPieces name_pieces(const Surface& surface, const std::map<std::string, ChamberOptions>& options);

}  // namespace pellicle::gas
