#pragma once

#include "state/field_registry.h"

namespace pellicle {
inline namespace world {

/// What changes of every object from step to step. Ghosts are up to date between steps. A step that fails is put back
/// by assigning a copy.
struct ObjectState : FieldRegistry {
  using FieldRegistry::FieldRegistry;
  ObjectState(ObjectState&&) = default;
  ObjectState& operator=(const ObjectState& other) {
    FieldRegistry::operator=(other);
    return *this;
  }

  double& time = add<double>({"time", "s", Item::object});
  PetscInt& step = add<PetscInt>({"step", "", Item::object});             ///< accepted steps
  double& next_length = add<double>({"next_length", "s", Item::object});  ///< of the next step, see Chain::length
  Field& position = add<Field>({"position", "m", Item::particle}, 3);
  Field& velocity = add<Field>({"velocity", "m/s", Item::particle, Drawn::yes}, 3);
};

}  // namespace world
}  // namespace pellicle
