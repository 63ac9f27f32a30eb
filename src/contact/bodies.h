#pragma once

#include <mpi.h>

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "geometry/solids.h"
#include "options/options.h"
#include "parallel/field.h"
#include "surface/surface.h"

namespace pellicle::contact {

/// Shape of a body: the number of its kind among shape_kinds(), or the number behind the last one for a mesh.
enum class BodyShape : int {};
std::vector<std::string> names_of(BodyShape);

/// How a body acts on what touches it.
struct BodyLaws {
  double friction = 0;                ///< Coulomb's coefficient
  double margin = 0;                  ///< gap kept between the surface and what touches it [m]
  double restitution = 0;             ///< speed off the body over speed towards it, when something comes to touch it
  std::optional<double> temperature;  ///< [K]; none: exchanges no heat
  double heat_transfer = 500;         ///< to what touches it [W/(m^2 K)]
  double heat_reach = 5e-3;           ///< gap, beyond that of contact, over which heat_transfer falls to 0 [m]
};

/// A solid that the sheet cannot enter, as a deck gives it: one of the named objects `bodies`.
struct BodyOptions : BodyLaws {
  Choice<BodyShape> shape = BodyShape{};
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();            ///< at time 0, of all but planes [m]
  double radius = 0.1;                                         ///< of spheres, capsules, cylinders, rings [m]
  std::vector<double> size{0.1, 0.1, 0.1};                     ///< edges of a box [m]
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();             ///< of a capsule, cylinder or ring, any length
  double length = 0.2;                                         ///< of a cylinder, a capsule without its caps [m]
  double tube_radius = 0.02;                                   ///< of a ring [m]
  std::string file;                                            ///< of a mesh
  double scale = 1;                                            ///< factor on the coordinates of a mesh
  Eigen::Vector3d point = Eigen::Vector3d::Zero();             ///< of the plane at time 0 [m]
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();           ///< of the plane, out of the solid, any length
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();          ///< [m/s]
  Rows path;                                                   ///< time [s], x, y, z [m] of the centre or the point
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< [rad/s]
  Rows rotation;                                               ///< time [s], x, y, z [rad]: rotation vectors
};

void describe(OptionTable& table, BodyOptions& options);

/// A rigid solid that moves.
struct Body : BodyLaws {
  std::string name;
  Shape shape;
  RigidMotion motion;

  /// The solid in its pose at a time [s].
  Solid at(double time) const { return {shape, motion.at(time)}; }
};

/// Makes bodies from the options of a deck; rank 0 reads their meshes. Collective.
/// @throws Error that names the body and the key, the same on all ranks.
std::vector<Body> make_bodies(MPI_Comm comm, const std::map<std::string, BodyOptions>& options);

/// Load of a surface on a body in a step.
struct BodyLoad {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< on the body: pressure, friction and impacts [N]
  double gap = 0;  ///< least gap beyond the body's margin, at most the thickness of contacts [m]
};

/// Message that names the first body in which free particles are at a time, its margin included, and their number;
/// empty if there is none. Collective.
/// @param constrained local particles that are left out
/// @param least depth at which a particle counts, at most half the depth of the body [m]
std::string particles_inside(const std::vector<Body>& bodies, double time, const Layout& particles,
                             const Field& positions, const std::vector<bool>& constrained, double least);
/// Like particles_inside, for surface triangles, which a body may pierce between their corners. Triangles with a
/// constrained corner are left out, and so are the margins of bodies. Collective.
std::string triangles_inside(const std::vector<Body>& bodies, double time, const Surface& surface,
                             const Field& positions, const std::vector<bool>& constrained, double least);

}  // namespace pellicle::contact
