#pragma once

#include <Eigen/Core>
#include <vector>

#include "surface/membrane.h"
#include "world/object_state.h"

namespace pellicle {

/// All that changes of a balloon from step to step.
struct BalloonState : ObjectState {
  /// At rest in the undeformed shape. The membrane must outlive the state. Collective.
  BalloonState(const Membrane& membrane, int chambers)
      : ObjectState(membrane.particles, {membrane.elements.owned, membrane.elements.local()}),
        pressure(add<Eigen::VectorXd>({"pressure", "Pa", Item::object}, chambers)) {
    position.values() = membrane.rest;
    thickness_ratio.assign(thickness_ratio.size(), 1.0);
  }
  BalloonState(BalloonState&&) = default;
  BalloonState& operator=(const BalloonState& other) {
    ObjectState::operator=(other);
    return *this;
  }

  /// h/h0 of the local elements.
  std::vector<double>& thickness_ratio = add<std::vector<double>>({"thickness_ratio", "", Item::cell, Drawn::yes});
  Eigen::VectorXd& pressure;  ///< across the wall, of each chamber, the same on every rank
};

}  // namespace pellicle
