#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "air/wind.h"
#include "energies/vertex_potential.h"
#include "parallel/field.h"
#include "surface/surface.h"

namespace pellicle::air {

/// The drag of the air on a surface: on each surface triangle of area A by the cross-flow principle (Hoerner,
/// Fluid-Dynamic Drag, 1965, 3-11), normal and tangential parts apart,
///
///     F = rho A/2 (C_n |u_n| u_n + C_t |u_t| u_t),  u = wind at the centroid - velocity.
///
/// The points of a triangle get their fractions of F (Surface::point_shares), each with its own velocity v_i in u;
/// |u_n| and |u_t| are of the mean velocity, so that the shares add up to F. A lattice point without mass leaves its
/// fraction to the two corners of the triangle. So the force on a particle is
///
///     f_i = b_i - D_i v_i,  D_i symmetric with eigenvalues of at least 0.
///
/// It is linearly implicit: |u_n|, |u_t| and the places are those at the start of a step, v_i and the wind those at its
/// end. So a step's drag brings velocities nearer to the wind's and never beyond it, however long the step is and
/// however light the surface; and a flat sheet that falls reaches its terminal speed for every length of the step.
class AirDrag {
 public:
  /// The surface must outlive this object. @throws Error as Wind does
  AirDrag(const Surface& surface, const AirOptions& options);

  /// Sets D and b for the step. Not collective.
  /// @param position, velocity where the drag is taken, as at the start of the step [m], [m/s], ghosts up to date
  /// @param mass of a sheet's local particles; 0: no force acts on it [kg]
  /// @param active surface triangles that live; null: all @param time at which the wind is taken [s]
  void begin_step(const Field& position, const Field& velocity, const std::vector<double>& mass,
                  const std::vector<bool>* active, double time);

  /// D_i [N s/m] and b_i [N] of an owned particle; 0 before the first step.
  const Eigen::Matrix3d& resistance(PetscInt i) const { return resistance_[i]; }
  Eigen::Vector3d push(PetscInt i) const { return impulse_.col(i); }

  /// The velocities after a time h of drag alone, (m_i + h D_i)^-1 (m_i v_i + h b_i); those of particles without mass
  /// stay. Collective.
  /// @param velocity [m/s], ghosts up to date before and after
  /// @param mass of the local particles [kg]
  void accelerate(Field& velocity, const std::vector<double>& mass, double h) const;

 private:
  const Surface& surface_;
  AirOptions options_;
  Wind wind_;
  std::vector<Eigen::Matrix3d> resistance_;  ///< D of the owned particles
  Eigen::Matrix3Xd impulse_;                 ///< b of the owned particles
};

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
