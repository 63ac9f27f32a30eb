#pragma once

#include <string>
#include <vector>

#include "state/field_registry.h"
#include "state/hdf5_file.h"

namespace pellicle::state {

// The fields of an object as tables of a file: GROUP/particles/NAME and GROUP/cells/NAME have a row an item, in the
// order of the persistent ids, GROUP/once/NAME values once on the object, GROUP/sums/NAME a row a rank. Fields that
// follow from others are left out.

/// Writes the fields. Collective. @throws Error, on all ranks
/// @param particle_ids, cell_ids persistent, of the owned items
void write_fields(Hdf5File& file, const std::string& group, const FieldRegistry& fields,
                  const std::vector<PetscInt>& particle_ids, const std::vector<PetscInt>& cell_ids);

/// Reads the fields of a registry, and those that a program had added before it was written, ghosts included, except
/// those that follow from others; sums are read by rank if as many ranks have written them, otherwise rank 0 gets all.
/// Collective.
/// @param particle_ids, cell_ids persistent, of the local items
/// @throws Error, on all ranks, if a field has no table of its kind, or an item has no row
void read_fields(const Hdf5File& file, const std::string& group, FieldRegistry& fields,
                 const std::vector<PetscInt>& particle_ids, const std::vector<PetscInt>& cell_ids);

}  // namespace pellicle::state
