#pragma once

#include "combustion/combustion.h"
#include "surface/sheet.h"
#include "world/burning_fields.h"
#include "world/object_state.h"

namespace pellicle {
inline namespace world {

/// All that changes in a sheet from step to step.
struct State : ObjectState, BurningFields {
  /// At first everything lives and is at rest; the pieces are not found yet, nothing is pinned and there is no gas. The
  /// sheet must outlive the state. Collective.
  explicit State(const Sheet& sheet);
  State(State&&) = default;
  State& operator=(const State& other) {
    ObjectState::operator=(other);
    return *this;
  }

  /// Number of the pin that holds each local particle, -1: none (Pins).
  std::vector<PetscInt>& pin = add<std::vector<PetscInt>>({"pin", "", Item::particle});
  /// Number of the chamber that each local cell bounds, -1: none (Chambers).
  std::vector<PetscInt>& chamber = add<std::vector<PetscInt>>({"chamber", "", Item::cell});
  TargetLengths& target_length;  ///< [m]
  /// Pressure that has acted in the last step, of each chamber of gas, the same on every rank.
  std::vector<double>& pressure = add<std::vector<double>>({"pressure", "Pa", Item::object});
};

}  // namespace world
}  // namespace pellicle
