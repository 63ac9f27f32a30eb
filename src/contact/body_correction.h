#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "contact/body_sweep.h"

namespace pellicle {
inline namespace contact {

/// What contact with bodies needs to know of a step.
struct ContactStep {
  const Layout& particles;
  const Field& start;               ///< positions at the beginning of the step [m], ghosts up to date
  const std::vector<bool>& pinned;  ///< of each local particle; a pinned particle is left alone
  double time_end = 0;              ///< at the end of the step [s]
  double h = 0;                     ///< length of the step [s]
  const std::vector<double>& mass;  ///< of each local particle [kg]
  /// At the beginning of the step, of particles that may rebound [m/s]; null: nothing rebounds
  const Field* start_velocity = nullptr;
};

/// Bodies that move a sheet out of themselves: they correct its positions and velocities, and nothing has to be brought
/// into balance. Between steps they keep nothing but the force on them: a step may be repeated.
///
/// Coulomb friction adds up over the calls of a step: a point that is pushed out of a body by d may lose up to mu d of
/// its displacement along the surface relative to the body, as by an impulse m d/h.
///
/// Particles keep the margin of a body, drawn triangles keep out of the body itself: with a margin of a few chords'
/// heights they do so by themselves.
///
/// Nothing passes through a body between two calls: particles and drawn triangles are stopped in its middle, from where
/// they are pushed out to the side from which they came.
class BodyCorrection {
 public:
  static constexpr double tolerance = 0.1;  ///< of the thickness, to which a drawn triangle may be in a body

  /// Collective. Surface must outlive it. @param thickness gap up to which they note how near the surface is [m]
  /// @throws Error as make_bodies does
  BodyCorrection(const Surface& surface, const std::map<std::string, BodyOptions>& bodies, double thickness);

  const std::vector<Body>& bodies() const { return bodies_; }
  bool empty() const { return bodies().empty(); }

  /// Forgets the forces of the last step. Not collective.
  /// @param living drawn triangles of the local elements that are there; null: all
  void begin_step(const ContactStep& step, const std::vector<bool>* living);

  /// Puts the particles that are inside a body on its surface (burning paper, eq. 14), friction included. To be called
  /// at every projection step. Collective. @param positions [m], ghosts up to date before and after
  void correct_positions(Field& positions, const ContactStep& step);

  /// To be called at the end of a step, behind `correct_positions`: puts the drawn triangles there, too, by the deepest
  /// point of each, which moves its corners by their shares in it and inversely to their masses, until none is deeper
  /// in a body than half of the tolerance. Collective. @returns whether any triangle had to be, on any rank
  bool correct_triangles(Field& positions, const ContactStep& step);

  /// How many particles of this rank the last corrections of the step have moved.
  PetscInt contacts() const { return static_cast<PetscInt>(std::count(is_touched_.begin(), is_touched_.end(), true)); }

  /// Takes the approaching part from the velocities of particles on a surface, relative to the body, and up to mu times
  /// as much from the part along the surface (burning paper, eq. 15). What has come to touch a body leaves it with its
  /// restitution. The same of the deepest points of triangles that touch a body. Collective.
  /// @param velocities [m/s] after eq. 13, ghosts up to date before and after
  /// @param positions [m] at the end of the step
  /// @returns how many particles of this rank approached a body
  PetscInt correct_velocities(Field& velocities, const Field& positions, const ContactStep& step);

  /// Over all calls since `begin_step`, at the positions of `correct_velocities`. Collective.
  std::vector<BodyLoad> loads(const Field& positions, const ContactStep& step) const;
  /// In words, the body that particles are too deep in where the step starts, and how many; empty: none. Collective.
  std::string start_fault() const { return sweep_.start_fault(tolerance * sweep_.thickness()); }
  /// In words, that a triangle is too deep in a body, which `correct_triangles` could not cure; empty: none is.
  std::string fault(const std::vector<BodyLoad>& loads) const;

 private:
  void push_particles(Field& positions, const ContactStep& step);
  bool push_triangles(Field& positions, const ContactStep& step, const std::vector<bool>* with);
  Eigen::Vector3d corrected(std::size_t body, const SignedDistance& gap, double margin, const Eigen::Vector3d& start,
                            const Eigen::Vector3d& x) const;
  void add_force(std::size_t body, PetscInt particle, const Eigen::Vector3d& moved_by, const ContactStep& step);
  void stop_triangles(Field& velocities, const Field& positions, const ContactStep& step);

  const Surface& surface_;
  std::vector<Body> bodies_;
  BodySweep sweep_;                     ///< without margins
  std::vector<Eigen::Vector3d> force_;  ///< on each, by this rank's particles [N]
  std::vector<double> triangle_gap_;    ///< of each, the least of this rank's triangles, at most the thickness [m]
  // Since the step began:
  bool is_moved_ = false;         ///< positions have been corrected
  Field last_;                    ///< to where [m]
  std::vector<bool> is_touched_;  ///< of the owned particles, in the last correction
};

}  // namespace contact
}  // namespace pellicle
