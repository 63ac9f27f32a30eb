#pragma once

#include <Eigen/Core>
#include <vector>

#include "state/field_registry.h"
#include "surface/membrane.h"

namespace pellicle {

/// All that changes of a balloon from step to step. Ghosts are up to date between steps. A step that fails is put back
/// by assigning a copy.
struct BalloonState : FieldRegistry {
  /// At rest in the undeformed shape. The membrane must outlive the state. Collective.
  BalloonState(const Membrane& membrane, int chambers)
      : FieldRegistry(membrane.particles, {membrane.elements.owned, membrane.elements.local()}),
        pressure(add<Eigen::VectorXd>({"pressure", "Pa", Item::object}, chambers)) {
    position.values() = membrane.rest;
    thickness_ratio.assign(thickness_ratio.size(), 1.0);
  }
  BalloonState(BalloonState&&) = default;
  BalloonState& operator=(const BalloonState& other) {
    FieldRegistry::operator=(other);
    return *this;
  }

  double& time = add<double>({"time", "s", Item::object});
  PetscInt& step = add<PetscInt>({"step", "", Item::object});             ///< accepted steps
  double& next_length = add<double>({"next_length", "s", Item::object});  ///< of the next step, see Chain::length
  Field& position = add<Field>({"position", "m", Item::particle}, 3);
  Field& velocity = add<Field>({"velocity", "m/s", Item::particle, Drawn::yes}, 3);
  /// h/h0 of the local elements.
  std::vector<double>& thickness_ratio = add<std::vector<double>>({"thickness_ratio", "", Item::cell, Drawn::yes});
  Eigen::VectorXd& pressure;  ///< across the wall, of each chamber, the same on every rank
};

}  // namespace pellicle
