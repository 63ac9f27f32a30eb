#include "contact/bodies.h"

#include "base/error.h"
#include "geometry/key_points.h"

namespace pellicle {
inline namespace contact {

namespace {

/// A particle this near to a surface touches it: far above rounding, far below any sheet's thickness [m].
constexpr double touching = 1e-9;

/// What is left of a slip along a surface when friction can take away up to `limit` of its length.
Eigen::Vector3d slip_after_friction(const Eigen::Vector3d& slip, double limit) {
  const double length = slip.norm();
  return length > limit ? Eigen::Vector3d(slip * (1 - limit / length)) : Eigen::Vector3d(Eigen::Vector3d::Zero());
}

Eigen::Vector3d along_surface(const Eigen::Vector3d& vector, const Eigen::Vector3d& normal) {
  return vector - normal * normal.dot(vector);
}

void require_valid(const std::string& key, const BodyOptions& options) {
  const std::string fault = fault_of_motion(options.path, options.velocity);
  if (!fault.empty()) {
    throw Error(key + fault);
  }
  if (options.normal.isZero(0)) {
    throw Error(key + ".normal: 0, 0, 0 given, expected a vector that is not zero");
  }
}

}  // namespace

void describe(OptionTable& table, BodyOptions& options) {
  table.add("shape", options.shape).help("what the body is; a plane is solid behind it");
  const Condition sphere = one_of("shape", options.shape, {BodyShape::sphere});
  const Condition plane = one_of("shape", options.shape, {BodyShape::plane});
  const Condition without_path{"no path", [&options] { return options.path.empty(); }};
  table.add("centre", options.centre)
      .unit("m")
      .acts_with(sphere)
      .acts_with(without_path)
      .help("centre of a sphere at time 0");
  table.add("radius", options.radius).unit("m").more_than(0).acts_with(sphere).help("radius of a sphere");
  table.add("point", options.point)
      .unit("m")
      .acts_with(plane)
      .acts_with(without_path)
      .help("a point of a plane at time 0");
  table.add("normal", options.normal).acts_with(plane).help("normal of a plane, towards the sheet; any length");
  table.add("velocity", options.velocity).unit("m/s").acts_with(without_path).help("constant velocity");
  table.add("path", options.path)
      .unit("s,m,m,m")
      .help(
          "key points (time, x, y, z) of the centre or the point, which replaces them; linear between key points, at "
          "rest before and after them");
  table.add("friction", options.friction)
      .at_least(0)
      .help("coefficient of Coulomb friction between body and sheet")
      .source("burning paper, section 7");
  table.add("margin", options.margin).unit("m").at_least(0).help("gap kept between the body and the particles");
}

std::vector<Body> make_bodies(const std::map<std::string, BodyOptions>& options) {
  std::vector<Body> bodies;
  for (const auto& [name, given] : options) {
    require_valid("bodies." + name, given);
    const auto start = [&path = given.path](const Eigen::Vector3d& place) {
      return path.empty() ? place : place_on_key_points(path, 0);
    };
    const Solid solid = given.shape == BodyShape::sphere
                            ? Solid(Sphere{start(given.centre), given.radius})
                            : Solid(HalfSpace{start(given.point), given.normal.normalized()});
    bodies.push_back({solid, given.velocity, given.path, given.friction, given.margin});
  }
  return bodies;
}

Eigen::Vector3d Body::displacement(double from, double to) const {
  return path.empty() ? Eigen::Vector3d(velocity * (to - from))
                      : Eigen::Vector3d(place_on_key_points(path, to) - place_on_key_points(path, from));
}

PetscInt Bodies::correct_positions(Field& positions, const ContactStep& step) const {
  PetscInt inside = 0;
  for (const Body& body : bodies_) {
    const Solid solid = body.at(step.time_end);
    const Eigen::Vector3d carried = body.displacement(step.time_end - step.h, step.time_end);
    for (PetscInt i = 0; i < step.particles.local(); ++i) {
      auto x = positions.vector(i);
      const SignedDistance gap = signed_distance(solid, x);
      const double push = body.margin - gap.distance;
      if (push <= 0 || step.pinned[static_cast<std::size_t>(i)]) {
        continue;
      }
      inside += i < step.particles.owned ? 1 : 0;
      x += push * gap.normal;
      if (body.friction > 0) {
        const Eigen::Vector3d slip = along_surface(x - step.start.vector(i) - carried, gap.normal);
        x += slip_after_friction(slip, body.friction * push) - slip;
        // The tangent plane leaves a curved surface.
        const SignedDistance left = signed_distance(solid, x);
        x += (body.margin - left.distance) * left.normal;
      }
    }
  }
  return inside;
}

PetscInt Bodies::correct_velocities(Field& velocities, const Field& positions, const ContactStep& step) const {
  PetscInt approaching = 0;
  for (const Body& body : bodies_) {
    const Solid solid = body.at(step.time_end);
    // The mean over the step, as in eq. 13: a particle that sticks to the body has just this velocity.
    const Eigen::Vector3d body_velocity = body.displacement(step.time_end - step.h, step.time_end) / step.h;
    for (PetscInt i = 0; i < step.particles.local(); ++i) {
      const SignedDistance gap = signed_distance(solid, positions.vector(i));
      const Eigen::Vector3d relative = velocities.vector(i) - body_velocity;
      const double approach = -relative.dot(gap.normal);
      if (gap.distance > body.margin + touching || approach <= 0 || step.pinned[static_cast<std::size_t>(i)]) {
        continue;
      }
      approaching += i < step.particles.owned ? 1 : 0;
      velocities.vector(i) =
          body_velocity + slip_after_friction(along_surface(relative, gap.normal), body.friction * approach);
    }
  }
  return approaching;
}

}  // namespace contact
}  // namespace pellicle
