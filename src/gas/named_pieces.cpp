#include "gas/named_pieces.h"

#include <cstddef>

#include "base/error.h"
#include "parallel/collective.h"

namespace pellicle {
inline namespace gas {

namespace {

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
  piece = max_over_ranks(surface.comm(), piece);
  if (piece < 0) {
    throw Error(chamber + ".vertex: " + std::to_string(vertex) + " is no vertex of the mesh, expected one of it");
  }
  return piece;
}

}  // namespace

std::string name_of_piece(const std::string& name, int piece) {
  return piece == 1 ? name : name + "_" + std::to_string(piece);
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

}  // namespace gas
}  // namespace pellicle
