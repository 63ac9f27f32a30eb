#pragma once

#include "combustion/combustion.h"
#include "surface/living.h"
#include "surface/pieces.h"
#include "surface/sheet.h"
#include "world/object_state.h"

namespace pellicle {

/// All that changes of a sheet from step to step.
struct State : ObjectState {
  /// Everything lives and is at rest; the pieces are yet to be found, nothing is pinned. The sheet must outlive the
  /// state. Collective.
  explicit State(const Sheet& sheet);
  State(State&&) = default;
  State& operator=(const State& other) {
    ObjectState::operator=(other);
    return *this;
  }

  Field& temperature = add<Field>({"temperature", "K", Item::particle, Drawn::of_both_layers});
  Field& mass = add<Field>({"mass", "kg", Item::particle});                ///< 0: the particle has left the sheet
  Field& mass_change = add<Field>({"mass_change", "kg", Item::particle});  ///< of the last step, at most 0
  /// Number of the pin that holds each local particle, -1: none (Pins).
  std::vector<PetscInt>& pin = add<std::vector<PetscInt>>({"pin", "", Item::particle});
  Pieces& pieces;
  /// When each local cell began to burn away or to tear; -1: not yet.
  std::vector<double>& burn_time = add<std::vector<double>>({"burn_time", "s", Item::cell, Drawn::yes});
  Living& living;
  TargetLengths& target_length;  ///< [m]
  /// Since the beginning, by the owned particles, with what was left when they left.
  double& mass_burnt = add<double>({"mass_burnt", "kg", Item::sum});
  // Heat ledger, of the owned particles: the content is initial + in - out + made.
  double& heat_initial = add<double>({"heat_initial", "J", Item::sum});  ///< by the particles owned at the beginning
  double& heat_in = add<double>({"heat_in", "J", Item::sum});      ///< from sources, burning and warmer surroundings
  double& heat_out = add<double>({"heat_out", "J", Item::sum});    ///< to cooler surroundings and with what burnt
  double& heat_made = add<double>({"heat_made", "J", Item::sum});  ///< by conduction that does not conserve it
};

}  // namespace pellicle
