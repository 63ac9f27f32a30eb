#pragma once

#include <vector>

#include "parallel/field.h"
#include "surface/living.h"
#include "surface/surface.h"

namespace pellicle {
inline namespace surface {

/// The pieces of a surface: its parts that no living spring (of a membrane: edge) joins to the rest.
struct Pieces {
  std::vector<PetscInt> of_particle;  ///< id of the piece of each local particle, -1 where no spring lives
  std::vector<PetscInt> present;      ///< ids of those that are there, rising; the same on all ranks
  std::vector<double> birth_time;     ///< when each of these separated [s]; 0 for what the surface begins with
  PetscInt next_id = 0;

  /// Place in `present` of the piece of this id, which must be there.
  std::size_t place_of(PetscInt id) const;
};

/// The pieces of a surface of which everything lives: ids 0, 1, ... in the order of their least persistent ids.
/// Collective.
Pieces initial_pieces(const Surface& surface);

/// Finds the pieces anew after springs have died. The part of a piece with most particles keeps the id (of equal parts
/// the one with the least persistent id); the others get new ids, in the order of their pieces' ids and of their least
/// persistent ids, so that ids depend neither on ranks nor on compaction. Collective.
/// @param time [s] becomes the time of birth of those that separated
void update_pieces(Pieces& pieces, const Surface& surface, const Living& living, double time);

/// Mass of each present piece, the same on all ranks [kg]. Collective.
std::vector<double> piece_masses(const Pieces& pieces, const Surface& surface, const Field& mass);

}  // namespace surface
}  // namespace pellicle
