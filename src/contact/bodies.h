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
#include "surface/surface.h"

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
  double heat_reach = 5e-3;           ///< gap, beyond that of contact, over which heat_transfer falls to 0 [m]
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
  double heat_reach = 0;              ///< [m]

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

/// In words, the first body that something is deeper in than the tolerance [m], a tenth of contact.thickness; empty:
/// none. @param loads of each body
std::string entered_too_deep(const std::vector<Body>& bodies, const std::vector<BodyLoad>& loads, double tolerance);

/// Whether anything rebounds from one of these bodies.
bool any_rebounds(const std::vector<Body>& bodies);

/// In words, the first body that free particles are in at a time, beyond its margin, and how many of them; empty: none.
/// Collective.
/// @param held local particles that do not count
/// @param least depth that counts, or half of that of the body if this is less [m]
std::string particles_inside(const std::vector<Body>& bodies, double time, const Layout& particles,
                             const Field& positions, const std::vector<bool>& held, double least);
/// Tells of drawn triangles in bodies, as particles_inside does of particles: a body may pierce a triangle between its
/// corners. Triangles with a held corner do not count, and the margin of a body does not belong to it here. Collective.
std::string triangles_inside(const std::vector<Body>& bodies, double time, const Surface& surface,
                             const Field& positions, const std::vector<bool>& held, double least);

}  // namespace contact
}  // namespace pellicle
