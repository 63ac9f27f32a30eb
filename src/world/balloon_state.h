#pragma once

#include <Eigen/Core>
#include <vector>

#include "parallel/field.h"
#include "surface/membrane.h"

namespace pellicle {

/// All that changes of a balloon from step to step. Ghosts are up to date between steps. A step that fails is put back
/// by assigning a copy: whatever is a member here is put back with it.
struct BalloonState {
  /// At rest in the undeformed shape.
  BalloonState(const Membrane& membrane, int chambers)
      : position(membrane.particles, 3),
        velocity(membrane.particles, 3),
        thickness_ratio(static_cast<std::size_t>(membrane.elements.local()), 1.0),
        pressure(Eigen::VectorXd::Zero(chambers)) {
    position.values() = membrane.rest;
  }

  double time = 0;                      ///< [s]
  int step = 0;                         ///< accepted steps
  Field position;                       ///< x [m]
  Field velocity;                       ///< v [m/s]
  std::vector<double> thickness_ratio;  ///< h/h0 of the local elements
  Eigen::VectorXd pressure;             ///< across the wall, of each chamber, the same on every rank [Pa]
};

}  // namespace pellicle
