#include "contact/bodies.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "base/error.h"
#include "base/units.h"
#include "geometry/deepest_point.h"
#include "geometry/rigid_motion.h"
#include "meshing/mesh_check.h"
#include "meshing/readers.h"
#include "meshing/triangulation.h"
#include "parallel/collective.h"
#include "surface/drawn_surface.h"

namespace pellicle::contact {

namespace {

/// The kind of a body's shape; null: a mesh.
const ShapeKind* kind_of(BodyShape shape) {
  const auto number = static_cast<std::size_t>(shape);
  return number < shape_kinds().size() ? &shape_kinds()[number] : nullptr;
}

bool has(BodyShape shape, ShapeOption option) { return kind_of(shape) != nullptr && kind_of(shape)->has(option); }

/// @throws Error
void require_valid(const std::string& key, const BodyOptions& options, const RigidMotion& motion) {
  refuse_fault(key, fault_of(motion));
  if (has(options.shape, ShapeOption::plane) && options.normal.isZero(0)) {
    throw Error(key + ".normal: 0, 0, 0 given, expected a vector that is not zero");
  }
  if (options.axis.isZero(0)) {
    throw Error(key + ".axis: 0, 0, 0 given, expected a vector that is not zero");
  }
  if (has(options.shape, ShapeOption::tube_radius) && options.tube_radius >= options.radius) {
    throw Error(key + ".tube_radius: " + number_text(options.tube_radius) + " m, expected less than the radius " +
                number_text(options.radius) + " m");
  }
  if (kind_of(options.shape) == nullptr && options.file.empty()) {
    throw Error(key + ".file: a body of shape mesh needs one, expected the name of a closed mesh");
  }
}

/// The mesh of a body, on every rank. Collective. @throws Error
std::shared_ptr<const ClosedMesh> read_closed_mesh(MPI_Comm comm, const std::string& key, const BodyOptions& options) {
  std::vector<Eigen::Vector3d> points;
  Triangles triangles;
  on_root(comm, [&] {
    SurfaceMesh mesh = read_mesh(options.file);
    check_and_repair(mesh, options.file);
    for (const Eigen::Vector3d& point : mesh.points) {
      points.emplace_back(options.scale * point);
    }
    for (const std::vector<int>& face : triangulated(mesh).faces) {
      triangles.push_back({face[0], face[1], face[2]});
    }
  });
  points = of_all_ranks(comm, points);
  triangles = of_all_ranks(comm, triangles);
  if (const std::string fault = fault_of_closed_mesh(points, triangles); !fault.empty()) {
    throw Error(key + ".file: " + options.file + ": " + fault + ", expected a closed mesh with normals outward");
  }
  return std::make_shared<const ClosedMesh>(std::move(points), std::move(triangles));
}

RigidMotion motion_of(const BodyOptions& options) {
  const bool is_plane = has(options.shape, ShapeOption::plane);
  Pose start;
  start.place = is_plane ? options.point : options.centre;
  if (is_plane || has(options.shape, ShapeOption::axis)) {
    start.turn = rotation_between(Eigen::Vector3d::UnitZ(), is_plane ? options.normal : options.axis);
  }
  return {start, options.velocity, options.path, options.angular_velocity, options.rotation};
}

}  // namespace

std::vector<std::string> names_of(BodyShape) {
  std::vector<std::string> names = names_in(shape_kinds());
  names.push_back("mesh");
  return names;
}

void describe(OptionTable& table, BodyOptions& options) {
  table.add("shape", options.shape,
            "what the body is; a plane is solid behind it, a capsule is a cylinder between two half balls, a ring is a "
            "torus, a mesh is read from a file");
  const auto last = static_cast<int>(shape_kinds().size());
  const auto of = [&options, last](ShapeOption option, bool has_it = true) {
    std::vector<BodyShape> all;
    for (int number = 0; number <= last; ++number) {
      if (has(BodyShape{number}, option) == has_it) {
        all.push_back(BodyShape{number});
      }
    }
    return one_of("shape", options.shape, all);
  };
  const Condition plane = of(ShapeOption::plane);
  const Condition solid = of(ShapeOption::plane, false);
  const Condition mesh = one_of("shape", options.shape, {BodyShape{last}});
  const Condition without_path{"no path", [&options] { return options.path.empty(); }};
  const Condition without_rotation{"no rotation", [&options] { return options.rotation.empty(); }};
  table.add("centre", options.centre, Rules("m").acts_with(solid).acts_with(without_path),
            "centre at time 0, of a mesh the origin of its file, about which the body turns");
  table.add("radius", options.radius, Rules("m").more_than(0).acts_with(of(ShapeOption::radius)),
            "radius; of a ring that of the circle in the middle of its tube");
  table.add("size", options.size, Rules("m").length(3).more_than(0).acts_with(of(ShapeOption::size)),
            "edges of a box along x, y and z, before it is turned");
  table.add("axis", options.axis, Rules().acts_with(of(ShapeOption::axis)),
            "axis of a capsule, cylinder or ring, before it is turned; any length");
  table.add("length", options.length, Rules("m").more_than(0).acts_with(of(ShapeOption::length)),
            "length of a cylinder, of a capsule without its half balls");
  table.add("tube_radius", options.tube_radius, Rules("m").more_than(0).acts_with(of(ShapeOption::tube_radius)),
            "radius of a ring's tube, less than its radius");
  table.add("file", options.file, Rules().file().acts_with(mesh),
            "closed mesh, with normals outward: obj, off, ply, stl, vtp, vtu, vtk or msh");
  table.add("scale", options.scale, Rules().more_than(0).acts_with(mesh),
            "by which the coordinates of the file are multiplied");
  table.add("point", options.point, Rules("m").acts_with(plane).acts_with(without_path),
            "a point of a plane at time 0, about which it turns");
  table.add("normal", options.normal, Rules().acts_with(plane), "normal of a plane, towards the sheet; any length");
  table.add("velocity", options.velocity, Rules("m/s").acts_with(without_path), "constant velocity");
  table.add("path", options.path, Rules("s,m,m,m"),
            "key points (time, x, y, z) of the centre or the point, which replaces them; linear between key points, at "
            "rest before and after them");
  table.add("angular_velocity", options.angular_velocity, Rules("rad/s").acts_with(without_rotation),
            "constant angular velocity about the centre or the point: along the axis of the turn, by the right hand");
  table.add(
      "rotation", options.rotation, Rules("s,rad,rad,rad"),
      "key points (time, x, y, z) of the rotation vector, which is the axis of a turn times its angle; linear between "
      "key points, at rest before and after them: [[0, 0, 0, 0], [1 s, 0, 0, 720 deg]] turns twice about z");
  table.add("friction", options.friction, Rules().at_least(0), "coefficient of Coulomb friction between body and sheet",
            "burning paper, section 7");
  table.add("margin", options.margin, Rules("m").at_least(0), "gap kept between the body and what touches it");
  table.add("restitution", options.restitution, Rules().range(0, 1),
            "speed with which what comes to touch the body leaves it, over that with which it came, both along the "
            "normal and relative to the body (of balloons by implicit Euler)");
  table.add("temperature", options.temperature, Rules("K").more_than(0),
            "heats or cools what touches the body; no heat is exchanged unless given");
  const Condition hot = is_given("temperature", options.temperature);
  table.add("heat_transfer", options.heat_transfer, Rules("W/(m^2 K)").more_than(0).acts_with(hot),
            "heat that flows between the body and what touches it, by area and difference of temperature");
  table.add("heat_reach", options.heat_reach, Rules("m").more_than(0).acts_with(hot),
            "gap over which heat_transfer falls smoothly to 0, beyond the gap at which a surface rests on the body; a "
            "few times the gaps that the mesh leaves where it touches a round body");
}

std::vector<Body> make_bodies(MPI_Comm comm, const std::map<std::string, BodyOptions>& options) {
  std::vector<Body> bodies;
  for (const auto& [name, given] : options) {
    const std::string key = "bodies." + name;
    const RigidMotion motion = motion_of(given);
    require_valid(key, given, motion);
    const ShapeKind* kind = kind_of(given.shape);
    const Eigen::Vector3d size(given.size.data());
    const Shape shape = kind != nullptr ? kind->of({given.radius, given.length, given.tube_radius, size})
                                        : read_closed_mesh(comm, key, given);
    bodies.push_back({given, name, shape, motion});
  }
  return bodies;
}

namespace {

/// Message that names the first body in which particles or triangles are; empty if there is none. Collective.
/// @param least depth at which one counts, at most half the depth of the body [m]
/// @param all number examined on all ranks @param what their name, such as "vertices"
/// @param depths_in depths of this rank's in a body [m]; called with the body and the depth that counts
template <class DepthsIn>
std::string first_with_any(MPI_Comm comm, const std::vector<Body>& bodies, double least, PetscInt all, const char* what,
                           const DepthsIn& depths_in) {
  for (const Body& body : bodies) {
    const double counts_from = std::min(least, depth_of(body.shape) / 2);
    PetscInt count = 0;
    double deepest = 0;
    for (const double depth : depths_in(body, counts_from)) {
      if (depth > counts_from) {
        ++count;
        deepest = std::max(deepest, depth);
      }
    }
    count = sum_over_ranks(comm, count);
    deepest = max_over_ranks(comm, deepest);
    if (count > 0) {
      return fmt::format(
          "bodies.{}: {} of {} {} lie inside it where the step starts, the deepest by {:.3g} m, expected none",
          body.name, count, all, what, deepest);
    }
  }
  return "";
}

}  // namespace

std::string particles_inside(const std::vector<Body>& bodies, double time, const Layout& particles,
                             const Field& positions, const std::vector<bool>& constrained, double least) {
  return first_with_any(particles.comm, bodies, least, particles.global, "vertices", [&](const Body& body, double) {
    const Solid solid = body.at(time);
    std::vector<double> depths;
    for (PetscInt i = 0; i < particles.owned; ++i) {
      if (!constrained[i]) {
        depths.push_back(body.margin - signed_distance(solid, positions.vector(i)).distance);
      }
    }
    return depths;
  });
}

std::string triangles_inside(const std::vector<Body>& bodies, double time, const Surface& surface,
                             const Field& positions, const std::vector<bool>& constrained, double least) {
  const PetscInt all = surface.elements.global * surface.triangles_per_element;
  const auto is_held = [&constrained](PetscInt i) { return constrained[i]; };
  return first_with_any(surface.comm(), bodies, least, all, "triangles", [&](const Body& body, double counts_from) {
    const Solid solid = body.at(time);
    std::vector<double> depths;
    for (PetscInt t = 0; t < surface.owned_triangles(); ++t) {
      const std::array<PetscInt, 3>& corners = surface.triangles[t];
      if (std::none_of(corners.begin(), corners.end(), is_held)) {
        const auto at = places_of_triangle(surface, positions.data(), t);
        if (const auto deepest = deepest_point(solid, at, 0, 0.1 * counts_from)) {
          depths.push_back(-deepest->gap.distance);
        }
      }
    }
    return depths;
  });
}

}  // namespace pellicle::contact
