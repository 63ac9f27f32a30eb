#pragma once

#include <memory>

#include "air/air_drag.h"
#include "energies/vertex_potential.h"

namespace pellicle::air {

/// The drag of an implicit step as a potential of the positions x at its end,
///
///     sum_i c (x_i - x_v,i).D_i (x_i - x_v,i) / 2 - b_i.(x_i - x^n_i),
///
/// whose gradient is D v - b with the step's velocity v = c (x - x_v). So a vertex at rest bears the whole drag, and
/// its other forces are not damped. Layout, drag and start must outlive it.
/// @param start x^n [m] @param rate gives c [1/s] @param y_v of an owned vertex gives x_v [m]
template <class Rate, class Still>
std::unique_ptr<Potential> make_drag_potential(const Layout& vertices, const AirDrag& drag, const Field& start,
                                               Rate rate, Still y_v) {
  return make_vertex_potential(vertices, [&drag, &start, rate, y_v](PetscInt i, const Eigen::Vector3d& x) {
    const Eigen::Matrix3d stiffness = rate() * drag.resistance(i);
    const Eigen::Vector3d moved = x - y_v(i);
    const Eigen::Vector3d push = drag.push(i);
    return PointPotential{moved.dot(stiffness * moved) / 2 - push.dot(x - start.vector(i)), stiffness * moved - push,
                          stiffness};
  });
}

}  // namespace pellicle::air
