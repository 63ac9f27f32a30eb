#pragma once

#include <mpi.h>

#include <Eigen/Core>
#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/options.h"
#include "geometry/solids.h"
#include "parallel/field.h"

namespace pellicle {
inline namespace contact {

enum class BodyShape { sphere, plane, box, capsule, cylinder, ring, mesh };
inline const std::vector<std::string>& names_of(BodyShape) {
  static const std::vector<std::string> names{"sphere", "plane", "box", "capsule", "cylinder", "ring", "mesh"};
  return names;
}

/// A solid that the sheet cannot enter, as a deck gives it: one of the named objects `bodies`.
struct BodyOptions {
  Choice<BodyShape> shape = BodyShape::sphere;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();            ///< at time 0, of all but planes [m]
  double radius = 0.1;                                         ///< of spheres, capsules, cylinders, rings [m]
  std::vector<double> size{0.1, 0.1, 0.1};                     ///< edges of a box [m]
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();             ///< of a capsule, cylinder or ring, any length
  double length = 0.2;                                         ///< of a cylinder, a capsule without its caps [m]
  double tube_radius = 0.02;                                   ///< of a ring [m]
  std::string file;                                            ///< of a mesh
  double scale = 1;                                            ///< of its coordinates
  Eigen::Vector3d point = Eigen::Vector3d::Zero();             ///< of the plane at time 0 [m]
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();           ///< of the plane, out of the solid, any length
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();          ///< [m/s]
  Rows path;                                                   ///< time [s], x, y, z [m] of the centre or the point
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< [rad/s]
  Rows rotation;                                               ///< time [s], x, y, z [rad]: rotation vectors
  double friction = 0;                                         ///< Coulomb's coefficient
  double margin = 0;                                           ///< gap kept between the surface and what touches it [m]
  double restitution = 0;             ///< speed off the body over speed towards it, when something comes to touch it
  std::optional<double> temperature;  ///< [K]; none: exchanges no heat
  double heat_transfer = 500;         ///< to what touches it [W/(m^2 K)]
};

void describe(OptionTable& table, BodyOptions& options);

/// A rigid solid that moves.
struct Body {
  std::string name;
  Shape shape;
  RigidMotion motion;
  double friction = 0;
  double margin = 0;  ///< [m]
  double restitution = 0;
  std::optional<double> temperature;  ///< [K]
  double heat_transfer = 0;           ///< [W/(m^2 K)]

  /// Its pose at a time [s].
  Solid at(double time) const { return {shape, motion.at(time)}; }
};

/// Where a point that is fixed to a solid moves to with it [m].
inline Eigen::Vector3d carried(const Pose& from, const Pose& to, const Eigen::Vector3d& point) {
  return to.to_world(from.to_own(point));
}

/// Rank 0 reads meshes. Collective.
/// @throws Error that names the body and the key, the same on all ranks.
std::vector<Body> make_bodies(MPI_Comm comm, const std::map<std::string, BodyOptions>& options);

/// What a surface has done to a body in a step.
struct BodyLoad {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< on the body: pressure, friction and impacts [N]
  double gap = 0;  ///< least gap beyond the body's margin, at most the thickness of contacts [m]
};

/// Whether anything rebounds from one of these bodies.
bool any_rebounds(const std::vector<Body>& bodies);

/// In words, the first body that free particles are in at a time, beyond its margin, and how many of them; empty: none.
/// Collective.
/// @param held local particles that do not count @param least depth that counts [m]
std::string particles_inside(const std::vector<Body>& bodies, double time, const Layout& particles,
                             const Field& positions, const std::vector<bool>& held, double least);

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

/// All bodies of a scene. Between calls it keeps nothing but the force on them: a step may be repeated.
///
/// Coulomb friction adds up over the calls of a step: a particle that is pushed out of a body by d may lose up to mu d
/// of its displacement along the surface relative to the body, as by an impulse m d/h.
class Bodies {
 public:
  /// Collective. @throws Error as make_bodies does.
  Bodies(MPI_Comm comm, const std::map<std::string, BodyOptions>& options)
      : bodies_(make_bodies(comm, options)), force_(bodies_.size(), Eigen::Vector3d::Zero()) {}

  /// Puts the particles that are inside a body on its surface (burning paper, eq. 14), friction included. To be called
  /// at every projection step. Not collective: local particles, ghosts too, are moved alike on every rank.
  /// @param positions [m], ghosts up to date before and after
  /// @returns how many particles of this rank were inside a body
  PetscInt correct_positions(Field& positions, const ContactStep& step);

  /// Takes the approaching part from the velocities of particles on a surface, relative to the body, and up to mu times
  /// as much from the part along the surface (burning paper, eq. 15). What has come to touch a body leaves it with its
  /// restitution. Not collective, ghosts as above.
  /// @param velocities [m/s] after eq. 13
  /// @param positions [m] at the end of the step
  /// @returns how many particles of this rank approached a body
  PetscInt correct_velocities(Field& velocities, const Field& positions, const ContactStep& step);

  /// Forgets the forces of the last step.
  void begin_step() { std::fill(force_.begin(), force_.end(), Eigen::Vector3d::Zero()); }
  /// Over all calls since `begin_step`. Collective. @param reach the gaps' upper limit [m]
  std::vector<BodyLoad> loads(const Field& positions, const ContactStep& step, double reach) const;

  const std::vector<Body>& bodies() const { return bodies_; }
  bool empty() const { return bodies_.empty(); }

 private:
  std::vector<Body> bodies_;
  std::vector<Eigen::Vector3d> force_;  ///< on each, by this rank's particles [N]
};

}  // namespace contact
}  // namespace pellicle
