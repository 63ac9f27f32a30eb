#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "contact/body_sweep.h"

namespace pellicle::contact {

/// Data of a step for contact with bodies.
struct ContactStep {
  const Field& start;               ///< positions at the beginning of the step [m], ghosts up to date
  const std::vector<bool>& pinned;  ///< of each local particle; pinned ones are not moved
  double time_end = 0;              ///< at the end of the step [s]
  double h = 0;                     ///< length of the step [s]
  const std::vector<double>& mass;  ///< of each local particle [kg]
  /// Velocities at the beginning of the step, if bodies have a restitution [m/s]; null: no rebound
  const Field* start_velocity = nullptr;
};

/// Contact of a sheet with bodies by projection: corrects positions and velocities without any balance of forces. Keeps
/// nothing between steps but the force on the bodies, so that a step may be repeated.
///
/// Coulomb friction adds up over the calls of a step: a point that is pushed out of a body by d may lose up to mu d of
/// its displacement along the surface relative to the body, as by an impulse m d/h.
///
/// Particles keep the margin of a body; surface triangles only stay outside the body. Where the margin is a few
/// sagittas of the triangles' sides, the particles alone ensure this.
///
/// Nothing passes through a body between two calls: particles and surface triangles are stopped at its middle, and from
/// there pushed out on the side from which they came.
class BodyCorrection {
 public:
  /// Collective. The surface must outlive this object. @param thickness largest gap that the loads report [m]
  /// @throws Error as make_bodies does
  BodyCorrection(const Surface& surface, const std::map<std::string, BodyOptions>& bodies, double thickness);

  const std::vector<Body>& bodies() const { return bodies_; }
  bool empty() const { return bodies().empty(); }

  /// Forgets the forces of the last step. Not collective.
  /// @param active surface triangles of the local elements that are there; null: all
  void begin_step(const ContactStep& step, const std::vector<bool>* active);

  /// Puts the particles that are inside a body on its surface (burning paper, eq. 14), friction included. To be called
  /// at every projection step. Collective. @param positions [m], ghosts up to date before and after
  void correct_positions(Field& positions, const ContactStep& step);

  /// Moves surface triangles out of bodies at the end of a step, after `correct_positions`: the deepest point of each
  /// moves its corners by their shares in it and inversely to their masses, until none is deeper in a body than half of
  /// the tolerance. Collective. @returns whether any triangle was moved, on any rank
  bool correct_triangles(Field& positions, const ContactStep& step);

  /// Number of this rank's particles that the last corrections of the step have moved.
  PetscInt contacts() const { return static_cast<PetscInt>(std::count(is_touched_.begin(), is_touched_.end(), true)); }

  /// Takes the approaching part from the velocities of particles on a surface, relative to the body, and up to mu times
  /// as much from the part along the surface (burning paper, eq. 15). What has come to touch a body leaves it with its
  /// restitution. The deepest points of triangles that touch a body are treated alike. Collective.
  /// @param velocities [m/s] after eq. 13, ghosts up to date before and after
  /// @param positions [m] at the end of the step
  void correct_velocities(Field& velocities, const Field& positions, const ContactStep& step);

  /// Loads on the bodies from all calls since `begin_step`, at the positions of `correct_velocities`. Collective.
  std::vector<BodyLoad> loads(const Field& positions, const ContactStep& step) const;
  /// The bodies without their margins in the present step.
  const BodySweep& sweep() const { return sweep_; }

 private:
  void push_particles(Field& positions, const ContactStep& step);
  bool push_triangles(Field& positions, const ContactStep& step, const std::vector<bool>* with);
  Eigen::Vector3d corrected(std::size_t body, const SignedDistance& gap, double margin, const Eigen::Vector3d& start,
                            const Eigen::Vector3d& x) const;
  void add_force(std::size_t body, PetscInt particle, const Eigen::Vector3d& moved_by, const ContactStep& step);
  void stop_triangles(Field& velocities, const Field& positions, const ContactStep& step);

  const Surface& surface_;
  std::vector<Body> bodies_;
  BodySweep sweep_;                     ///< for the bodies without their margins
  std::vector<Eigen::Vector3d> force_;  ///< on each body, by this rank's particles [N]
  std::vector<double> triangle_gap_;    ///< of each body: least gap of this rank's triangles, at most the thickness [m]
  // Since the step began:
  bool is_moved_ = false;         ///< positions have been corrected
  Field last_;                    ///< the corrected positions [m]
  std::vector<bool> is_touched_;  ///< of the owned particles, in the last correction
};

}  // namespace pellicle::contact
