#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "base/options.h"
#include "geometry/solids.h"
#include "parallel/field.h"

namespace pellicle {
inline namespace contact {

enum class BodyShape { sphere, plane };
inline const std::vector<std::string>& names_of(BodyShape) {
  static const std::vector<std::string> names{"sphere", "plane"};
  return names;
}

/// A solid that the sheet cannot enter, as a deck gives it: one of the named objects `bodies`.
struct BodyOptions {
  Choice<BodyShape> shape = BodyShape::sphere;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();    ///< of the sphere at time 0 [m]
  double radius = 0.1;                                 ///< of the sphere [m]
  Eigen::Vector3d point = Eigen::Vector3d::Zero();     ///< of the plane at time 0 [m]
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();   ///< of the plane, out of the solid, any length
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< [m/s]
  Rows path;                                           ///< time [s], x, y, z [m] of the centre or the point
  double friction = 0;                                 ///< Coulomb's coefficient
  double margin = 0;                                   ///< gap kept between the surface and the particles [m]
};

void describe(OptionTable& table, BodyOptions& options);

/// A solid that moves without turning.
struct Body {
  Solid solid;               ///< at time 0
  Eigen::Vector3d velocity;  ///< [m/s], if there is no path
  Rows path;
  double friction = 0;
  double margin = 0;  ///< [m]

  Solid at(double time) const { return moved_by(displacement(0, time), solid); }
  Eigen::Vector3d displacement(double from, double to) const;
};

/// @throws Error that names the body and the key, the same on all ranks.
std::vector<Body> make_bodies(const std::map<std::string, BodyOptions>& options);

/// The moment at which contacts are sought.
struct ContactStep {
  const Layout& particles;
  const Field& start;               ///< positions at the beginning of the step [m], ghosts up to date
  const std::vector<bool>& pinned;  ///< of each local particle; a pinned particle is left alone
  double time_end = 0;              ///< at the end of the step [s]
  double h = 0;                     ///< length of the step [s]
};

/// All bodies of a scene, which move without turning. Nothing is kept from call to call: a step may be repeated.
///
/// Coulomb friction sums up over the calls of a step: the push d of a particle out of a body may take away up to
/// mu d of its displacement along the surface relative to the body, as an impulse m d/h would.
class Bodies {
 public:
  /// @throws Error as make_bodies does.
  explicit Bodies(const std::map<std::string, BodyOptions>& options) : bodies_(make_bodies(options)) {}

  /// Puts the particles that are inside a body on its surface (burning paper, eq. 14), friction included. To be called
  /// at every projection step. Not collective: local particles, ghosts too, are moved alike on every rank.
  /// @param positions [m], ghosts up to date before and after
  /// @returns how many particles of this rank were inside a body
  PetscInt correct_positions(Field& positions, const ContactStep& step) const;

  /// Takes the approaching part from the velocities of particles on a surface, relative to the body, and up to mu times
  /// as much from the part along the surface (burning paper, eq. 15). Not collective, ghosts as above.
  /// @param velocities [m/s] after eq. 13
  /// @param positions [m] at the end of the step
  /// @returns how many particles of this rank approached a body
  PetscInt correct_velocities(Field& velocities, const Field& positions, const ContactStep& step) const;

  bool empty() const { return bodies_.empty(); }

 private:
  std::vector<Body> bodies_;
};

}  // namespace contact
}  // namespace pellicle
