#include "meshing/blobs.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "base/units.h"
#include "geometry/pi.h"
#include "geometry/rigid_motion.h"
#include "geometry/solid_distance.h"
#include "meshing/implicit_surface.h"
#include "options/options.h"

namespace pellicle::meshing {

namespace {

/// k of a blend of radius 1. Two planes at a right angle, joined by the sum of exponentials, pass their corner at the
/// distance sqrt(2) ln(2) k, and a circle of radius 1 passes it at sqrt(2) - 1.
const double width_of_blend = (std::sqrt(2.0) - 1) / (std::sqrt(2.0) * std::log(2.0));

bool has_two_ends(const BlobOptions& options) {
  return options.shape == BlobShape::capsule || options.shape == BlobShape::cylinder;
}

void require_valid(const std::string& key, const BlobOptions& options) {
  const double r = options.radius;
  const double end_radius = options.end_radius.value_or(r);
  const double length = (options.end - options.centre).norm();
  const double least_size = options.size.minCoeff();
  const bool is_box = options.shape == BlobShape::box;
  refuse_if(has_two_ends(options) && !(length > 0), "{}.end: the same as centre, expected another point", key);
  refuse_if(options.shape == BlobShape::capsule && std::abs(r - end_radius) >= length,
            "{}.end_radius: {} m given, expected one end that is not inside the other", key, number_text(end_radius));
  refuse_if((is_box || options.shape == BlobShape::ellipsoid) && !(least_size > 0),
            "{}.size: {} m given, expected lengths above 0", key, number_text(least_size));
  refuse_if((is_box || options.shape == BlobShape::cylinder) &&
                options.round > 0.5 * (is_box ? least_size : std::min(2 * r, length)),
            "{}.round: {} m given, expected at most half of its thickness", key, number_text(options.round));
  refuse_if(options.shape == BlobShape::torus && options.tube_radius >= r,
            "{}.tube_radius: {} m given, expected less than the radius", key, number_text(options.tube_radius));
}

}  // namespace

void describe(OptionTable& table, BlobOptions& options) {
  table.add("shape", options.shape,
            "what the solid is; a capsule is a cylinder with round ends, a round cone if its ends differ");
  table.add("operation", options.operation,
            "whether the solid is joined to the others or taken away from them; all adding comes first");
  table.add("centre", options.centre, Rules("m"), "its centre; of capsule and cylinder that of the first end");
  const auto add = [&](const char* key, auto& variable, const char* unit,
                       const std::vector<BlobShape>& shapes) -> auto& {
    return table.add(key, variable).unit(unit).acts_with(one_of("shape", options.shape, shapes));
  };
  add("radius", options.radius, "m", {BlobShape::sphere, BlobShape::capsule, BlobShape::cylinder, BlobShape::torus})
      .more_than(0)
      .help("its radius; of the torus that of the circle in the middle of its tube");
  add("end", options.end, "m", {BlobShape::capsule, BlobShape::cylinder}).help("centre of the other end");
  add("end_radius", options.end_radius, "m", {BlobShape::capsule})
      .more_than(0)
      .help("radius of the other end; none: the same");
  add("tube_radius", options.tube_radius, "m", {BlobShape::torus}).more_than(0).help("radius of its tube");
  add("size", options.size, "m", {BlobShape::box, BlobShape::ellipsoid})
      .more_than(0)
      .help("lengths along its own x, y and z");
  add("rotation", options.rotation, "rad", {BlobShape::ellipsoid, BlobShape::box, BlobShape::torus})
      .help("turned by these angles about the axes x, y and z, in this order, through its centre");
  add("round", options.round, "m", {BlobShape::box, BlobShape::cylinder}).at_least(0).help("radius of the edges");
  table.add("blend", options.blend, Rules("m").more_than(0),
            "radius of the fillet where it meets others of the same blend at a right angle");
  table.add("relief", options.relief, Rules("m").at_least(0),
            "height of the waves on its surface above and below the mean, see flutes and pitch");
  const Condition has_relief{"relief: more than 0", [&options] { return options.relief > 0; }};
  table.add("flutes", options.flutes, Rules().at_least(0).acts_with(has_relief),
            "waves of the relief round its own z axis; 0: rings only");
  table.add("pitch", options.pitch, Rules("m").at_least(0).acts_with(has_relief),
            "length of a wave of the relief along its own z axis; 0: flutes only, with both there are bumps");
}

Eigen::Matrix3d rotation_about_axes(const Eigen::Vector3d& angles) {
  return (Eigen::AngleAxisd(angles.z(), Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(angles.y(), Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(angles.x(), Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

Blobs::Blobs(const std::map<std::string, BlobOptions>& options) {
  for (const auto& [name, given] : options) {
    require_valid("mesh.blobs." + name, given);
    const Eigen::Vector3d arm = given.end - given.centre;
    const Eigen::Matrix3d rotation =
        has_two_ends(given) ? rotation_between(Eigen::Vector3d::UnitZ(), arm) : rotation_about_axes(given.rotation);
    const Solid solid{name, given, rotation.transpose(), arm.norm(), width_of_blend * given.blend};
    const double least = 1e-6 * solid.reach();
    refuse_if(given.blend < least, "mesh.blobs.{}.blend: {} m given, expected at least {}, a millionth of its size",
              name, number_text(given.blend), number_text(least));
    (given.operation == BlobOperation::add ? added_ : subtracted_).push_back(solid);
  }
  if (added_.empty()) {
    throw Error("mesh.blobs: no object that adds, expected at least one, such as {ball: {shape: sphere}}");
  }
  double widest = 0;
  for (const Solid& solid : added_) {
    const Eigen::Vector3d reach = Eigen::Vector3d::Constant(solid.reach());
    bounds_.extend(Eigen::AlignedBox3d(solid.options.centre - reach, solid.options.centre + reach));
    if (has_two_ends(solid.options)) {
      bounds_.extend(Eigen::AlignedBox3d(solid.options.end - reach, solid.options.end + reach));
    }
    widest = std::max(widest, solid.k);
  }
  // Where n surfaces coincide, the joint one is ln(n) k outside.
  const double bulge = widest * std::log(static_cast<double>(added_.size()));
  bounds_.min().array() -= bulge;
  bounds_.max().array() += bulge;
}

/// The radius of a ball round the centre, or round each end, that holds the solid.
double Blobs::Solid::reach() const {
  const BlobOptions& o = options;
  const double smooth = o.shape == BlobShape::box || o.shape == BlobShape::ellipsoid ? 0.5 * o.size.norm()
                        : o.shape == BlobShape::torus                                ? o.radius + o.tube_radius
                                                      : std::max(o.radius, o.end_radius.value_or(0));
  return smooth + o.relief;
}

/// @param own the point along the solid's own axes
double Blobs::Solid::distance_without_relief(const Eigen::Vector3d& own) const {
  const BlobOptions& o = options;
  switch (o.shape) {
    case BlobShape::sphere:
      return distance_from_sphere(own, o.radius);
    case BlobShape::ellipsoid:
      return distance_from_ellipsoid(own, 0.5 * o.size);
    case BlobShape::box:
      return distance_from_box(own, 0.5 * o.size, o.round);
    case BlobShape::capsule:
      return distance_from_round_cone(own, o.radius, o.end_radius.value_or(o.radius), length);
    case BlobShape::cylinder:
      return distance_from_cylinder(own, o.radius, length, o.round);
    case BlobShape::torus:
      break;
  }
  return distance_from_torus(own, o.radius, o.tube_radius);
}

double Blobs::Solid::distance(const Eigen::Vector3d& point) const {
  const BlobOptions& o = options;
  const Eigen::Vector3d own = to_own * (point - o.centre);
  double distance = distance_without_relief(own);
  if (o.relief > 0) {
    double wave = o.pitch > 0 ? std::cos(2 * pi * own.z() / o.pitch) : 1;
    if (o.flutes > 0) {
      // On the axis the flutes meet, so they are made to vanish there.
      const double r = own.head<2>().norm();
      const double fade = 0.3 * reach();
      wave *= std::cos(o.flutes * std::atan2(own.y(), own.x())) * r * r / (r * r + fade * fade);
    }
    distance -= o.relief * wave;
  }
  return distance;
}

double Blobs::operator()(const Eigen::Vector3d& point) const {
  // s = sum of exp(-d_i/k_i), scaled by its largest term; the mean of k_i in the same weights gives the value its unit.
  constexpr double lost = 60;  // a term that is smaller than the largest by exp(-60) does not change the sum
  double largest = -std::numeric_limits<double>::infinity();
  double sum = 0;
  double sum_of_k = 0;
  for (const Solid& solid : added_) {
    const double exponent = -solid.distance(point) / solid.k;
    const double difference = std::abs(exponent - largest);
    const double smaller = difference < lost ? std::exp(-difference) : 0;
    if (exponent > largest) {
      sum = sum * smaller + 1;
      sum_of_k = sum_of_k * smaller + solid.k;
      largest = exponent;
    } else {
      sum += smaller;
      sum_of_k += smaller * solid.k;
    }
  }
  double value = -(largest + std::log(sum)) * sum_of_k / sum;
  for (const Solid& solid : subtracted_) {
    const double hole = -solid.distance(point);
    value = std::max(value, hole) + solid.k * std::log1p(std::exp(-std::abs(value - hole) / solid.k));
  }
  return value;
}

std::string Blobs::idle_cut(const std::vector<Eigen::Vector3d>& surface_points) const {
  constexpr double touching = 3;  // in k: beyond it the blend moves the surface by less than exp(-3) k
  for (const Solid& solid : subtracted_) {
    const bool reaches = std::any_of(surface_points.begin(), surface_points.end(), [&solid](const auto& point) {
      return solid.distance(point) < touching * solid.k;
    });
    if (!reaches) {
      return solid.name;
    }
  }
  return "";
}

SurfaceMesh blobs_mesh(const std::map<std::string, BlobOptions>& blobs, int vertices) {
  const Blobs solids(blobs);
  SurfaceMesh mesh = implicit_surface_mesh({std::cref(solids), solids.bounds()}, vertices, "mesh.blobs");
  const std::string idle = solids.idle_cut(mesh.points);
  refuse_if(!idle.empty(), "mesh.blobs.{}: there is nothing to subtract it from, expected a solid that cuts the others",
            idle);
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& point : mesh.points) {
    box.extend(point);
  }
  std::vector<Eigen::Vector2d> uv;
  for (const Eigen::Vector3d& point : mesh.points) {
    const Eigen::Vector3d fraction = (point - box.min()).cwiseQuotient(box.sizes());
    uv.emplace_back(fraction.x(), fraction.z());
  }
  mesh.uv = uv_of_corners(mesh, uv);
  return mesh;
}

}  // namespace pellicle::meshing
