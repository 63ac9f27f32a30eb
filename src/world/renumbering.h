#pragma once

#include "parallel/records.h"
#include "state/field_registry.h"
#include "surface/split_corners.h"

namespace pellicle {
inline namespace world {

// The particle and element data of an object's state, on the way to the same object on a new surface.

/// The records of the owned items.
Records packed(const FieldRegistry& state, Item item, PetscInt owned);

/// The records for surface/compaction.h's `split`.
struct SplitRecords {
  Records particles;
  Records copies;
  Records cells;
};
SplitRecords packed(const FieldRegistry& state, const Surface& surface, const SplitCorners& corners);

/// Reads the records of the local items into the state of the new surface, and copies the fields that the object
/// has once from the old state. Collective.
void transfer(FieldRegistry& state, const FieldRegistry& old, const Records& particles, const Records& cells);

}  // namespace world
}  // namespace pellicle
