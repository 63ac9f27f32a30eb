#pragma once

#include "parallel/records.h"
#include "state/field_registry.h"
#include "surface/split_corners.h"

namespace pellicle {
inline namespace world {

// What an object's state has on particles and elements, on its way to the same object on a surface made anew.

/// The records of the owned items.
Records packed(const FieldRegistry& state, Item item, PetscInt owned);

/// The records for surface/compaction.h's `split`.
struct SplitRecords {
  Records particles;
  Records copies;
  Records cells;
};
SplitRecords packed(const FieldRegistry& state, const Surface& surface, const SplitCorners& corners);

/// Reads the records of the local items into the state of the new surface, and what the object has once from the state
/// of the old one. Collective.
void take_over(FieldRegistry& state, const FieldRegistry& old, const Records& particles, const Records& cells);

}  // namespace world
}  // namespace pellicle
