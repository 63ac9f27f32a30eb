#pragma once

#include <vector>

#include "base/disjoint_sets.h"
#include "parallel/field.h"
#include "surface/active_set.h"
#include "surface/surface.h"

namespace pellicle::surface {

/// The least id of all items that are connected with each local item, over all ranks. Collective.
/// @param connected sets of local items, among them all that are directly connected with an owned one
/// @param ids of the local items
std::vector<PetscInt> least_connected_ids(const Layout& items, DisjointSets& connected,
                                          const std::vector<PetscInt>& ids);

/// The pieces of a surface: its parts that active springs (edges of a membrane) connect.
struct Pieces {
  std::vector<PetscInt> of_particle;  ///< id of the piece of each local particle, -1 without active spring
  std::vector<PetscInt> present;      ///< ids of the present pieces, ascending; the same on all ranks
  std::vector<double> birth_time;     ///< when each present piece separated; 0 for initial pieces [s]
  PetscInt next_id = 0;

  /// Place in `present` of an id, which must be in it.
  std::size_t place_of(PetscInt id) const;
};

/// The pieces of a surface that lives entirely: ids 0, 1, ... in the order of their least persistent ids. Collective.
Pieces initial_pieces(const Surface& surface);

/// Finds the pieces anew after springs have died. The part of a piece with most particles keeps the id (of equal parts
/// the one with the least persistent id); the others get new ids, in the order of their pieces' ids and of their least
/// persistent ids, so that ids depend neither on ranks nor on compaction. Collective.
/// @param time birth time of the new pieces [s]
void update_pieces(Pieces& pieces, const Surface& surface, const ActiveSet& active, double time);

/// Mass of each present piece, the same on all ranks [kg]. Collective.
std::vector<double> piece_masses(const Pieces& pieces, const Surface& surface, const Field& mass);

}  // namespace pellicle::surface
