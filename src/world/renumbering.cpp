#include "world/renumbering.h"

namespace pellicle {
inline namespace world {

Records packed(const FieldRegistry& state, Item item, PetscInt owned) {
  Records records(state.record_size(item), owned);
  for (PetscInt i = 0; i < owned; ++i) {
    state.pack(item, i, records.at(i));
  }
  return records;
}

SplitRecords packed(const FieldRegistry& state, const Surface& surface, const SplitCorners& corners) {
  SplitRecords records{
      packed(state, Item::particle, surface.particles.owned), {}, packed(state, Item::cell, surface.elements.owned)};
  for (PetscInt i = 0; i < surface.particles.owned; ++i) {
    state.pack(Item::particle, i, records.particles.at(i), corners.fraction[i]);
  }
  records.copies = Records(records.particles.bytes(), static_cast<PetscInt>(corners.copies.size()));
  for (PetscInt k = 0; k < records.copies.count(); ++k) {
    const SplitCorners::Copy& copy = corners.copies[k];
    state.pack(Item::particle, copy.original, records.copies.at(k), copy.fraction);
  }
  return records;
}

void transfer(FieldRegistry& state, const FieldRegistry& old, const Records& particles, const Records& cells) {
  state.transfer(old);
  for (PetscInt i = 0; i < particles.count(); ++i) {
    state.unpack(Item::particle, i, particles.at(i));
  }
  for (PetscInt i = 0; i < cells.count(); ++i) {
    state.unpack(Item::cell, i, cells.at(i));
  }
}

}  // namespace world
}  // namespace pellicle
