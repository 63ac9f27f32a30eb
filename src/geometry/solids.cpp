#include "geometry/solids.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/pi.h"

namespace pellicle::geometry {

namespace {

/// The unit vector along a vector, or `otherwise` if the vector is 0.
Eigen::Vector3d direction_of(const Eigen::Vector3d& vector, double length, const Eigen::Vector3d& otherwise) {
  return length > 0 ? Eigen::Vector3d(vector / length) : otherwise;
}

Eigen::Vector3d away_from_axis(const Eigen::Vector3d& point, double distance) {
  return direction_of({point.x(), point.y(), 0}, distance, Eigen::Vector3d::UnitX());
}

double sign_of(double value) { return value < 0 ? -1 : 1; }

Eigen::AlignedBox3d box_of(double sideways, double upward) {
  const Eigen::Vector3d half(sideways, sideways, upward);
  return {-half, half};
}

/// A line of places (distance from the z axis, height) turned round the axis, from below to above.
Facets revolved(const std::vector<Eigen::Vector2d>& line) {
  constexpr int around = 64;  // points
  Facets facets;
  for (const Eigen::Vector2d& place : line) {
    for (int i = 0; i < around; ++i) {
      const double angle = 2 * pi * i / around;
      facets.points.emplace_back(place.x() * std::cos(angle), place.x() * std::sin(angle), place.y());
    }
  }
  for (int k = 0; k + 1 < static_cast<int>(line.size()); ++k) {
    for (int i = 0; i < around; ++i) {
      const int next = (i + 1) % around;
      const int a = around * k + i;
      const int b = around * k + next;
      const int c = around * (k + 1) + next;
      const int d = around * (k + 1) + i;
      facets.triangles.push_back({a, b, c});
      facets.triangles.push_back({a, c, d});
    }
  }
  return facets;
}

/// Adds an arc round a centre in the plane (x, z) to a line, from one angle to another, 0 along x [rad].
void add_arc(std::vector<Eigen::Vector2d>& line, const Eigen::Vector2d& centre, double radius, double from, double to) {
  constexpr int parts = 24;
  for (int i = 0; i <= parts; ++i) {
    const double angle = from + (to - from) * i / parts;
    line.push_back(centre + radius * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
  }
}

}  // namespace

SignedDistance Sphere::distance(const Eigen::Vector3d& point) const {
  const double length = point.norm();
  return {length - radius, direction_of(point, length, Eigen::Vector3d::UnitZ())};
}

SignedDistance HalfSpace::distance(const Eigen::Vector3d& point) const { return {point.z(), Eigen::Vector3d::UnitZ()}; }

SignedDistance Box::distance(const Eigen::Vector3d& point) const {
  const Eigen::Vector3d beyond = point.cwiseAbs() - half;
  Eigen::Index axis = 0;
  const double most = beyond.maxCoeff(&axis);
  if (most <= 0) {
    return {most, sign_of(point[axis]) * Eigen::Vector3d::Unit(axis)};
  }
  const Eigen::Vector3d arm = beyond.cwiseMax(0);
  const double length = arm.norm();
  return {length, point.unaryExpr(&sign_of).cwiseProduct(arm) / length};
}

SignedDistance Capsule::distance(const Eigen::Vector3d& point) const {
  const Eigen::Vector3d arm = point - Eigen::Vector3d(0, 0, std::clamp(point.z(), -half, half));
  const double length = arm.norm();
  return {length - radius, direction_of(arm, length, Eigen::Vector3d::UnitX())};
}

SignedDistance Cylinder::distance(const Eigen::Vector3d& point) const {
  const double from_axis = std::hypot(point.x(), point.y());
  const Eigen::Vector3d sideways = away_from_axis(point, from_axis);
  const Eigen::Vector3d upward = sign_of(point.z()) * Eigen::Vector3d::UnitZ();
  const double beyond_side = from_axis - radius;
  const double beyond_end = std::abs(point.z()) - half;
  if (beyond_side <= 0 || beyond_end <= 0) {
    return beyond_side > beyond_end ? SignedDistance{beyond_side, sideways} : SignedDistance{beyond_end, upward};
  }
  const double length = std::hypot(beyond_side, beyond_end);
  return {length, (beyond_side * sideways + beyond_end * upward) / length};
}

SignedDistance Ring::distance(const Eigen::Vector3d& point) const {
  const double from_axis = std::hypot(point.x(), point.y());
  const Eigen::Vector3d sideways = away_from_axis(point, from_axis);
  const Eigen::Vector3d arm = point - radius * sideways;
  const double length = arm.norm();
  return {length - tube, direction_of(arm, length, Eigen::Vector3d::UnitZ())};
}

Eigen::AlignedBox3d Sphere::box() const { return box_of(radius, radius); }
Eigen::AlignedBox3d HalfSpace::box() const {
  constexpr double far = std::numeric_limits<double>::infinity();
  return {Eigen::Vector3d::Constant(-far), Eigen::Vector3d(far, far, 0)};
}
Eigen::AlignedBox3d Capsule::box() const { return box_of(radius, half + radius); }
Eigen::AlignedBox3d Cylinder::box() const { return box_of(radius, half); }
Eigen::AlignedBox3d Ring::box() const { return box_of(radius + tube, tube); }

Facets Sphere::facets(double /*half_plane*/) const {
  std::vector<Eigen::Vector2d> line;
  add_arc(line, {0, 0}, radius, -pi / 2, pi / 2);
  return revolved(line);
}

Facets HalfSpace::facets(double half_plane) const {
  const double h = half_plane;
  return {{{-h, -h, 0}, {h, -h, 0}, {h, h, 0}, {-h, h, 0}}, {{0, 1, 2}, {0, 2, 3}}};
}

Facets Box::facets(double /*half_plane*/) const {
  Facets facets;
  for (int i = 0; i < 8; ++i) {
    facets.points.emplace_back(((i & 1) != 0 ? 1 : -1) * half[0], ((i & 2) != 0 ? 1 : -1) * half[1],
                               ((i & 4) != 0 ? 1 : -1) * half[2]);
  }
  facets.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                      {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return facets;
}

Facets Capsule::facets(double /*half_plane*/) const {
  std::vector<Eigen::Vector2d> line;
  add_arc(line, {0, -half}, radius, -pi / 2, 0);
  add_arc(line, {0, half}, radius, 0, pi / 2);
  return revolved(line);
}

Facets Cylinder::facets(double /*half_plane*/) const {
  return revolved({{0, -half}, {radius, -half}, {radius, half}, {0, half}});
}

Facets Ring::facets(double /*half_plane*/) const {
  std::vector<Eigen::Vector2d> line;
  add_arc(line, {radius, 0}, tube, -pi, pi);
  return revolved(line);
}

namespace {

const ClosedMesh& solid_of(const std::shared_ptr<const ClosedMesh>& mesh) { return *mesh; }
template <class Kind>
const Kind& solid_of(const Kind& shape) {
  return shape;
}

/// The result of `use` for what a shape is: a struct with a formula or a ClosedMesh.
template <class Use>
auto visit(const Shape& shape, const Use& use) {
  return std::visit([&use](const auto& kind) { return use(solid_of(kind)); }, shape);
}

}  // namespace

const std::vector<ShapeKind>& shape_kinds() {
  using Option = ShapeOption;
  using Given = const ShapeNumbers&;
  static const std::vector<ShapeKind> kinds{
      {"sphere", {Option::radius}, [](Given given) -> Shape { return Sphere{given.radius}; }},
      {"plane", {Option::plane}, [](Given /*given*/) -> Shape { return HalfSpace{}; }},
      {"box", {Option::size}, [](Given given) -> Shape { return Box{given.size / 2}; }},
      {"capsule",
       {Option::radius, Option::length, Option::axis},
       [](Given given) -> Shape {
         return Capsule{given.radius, given.length / 2};
       }},
      {"cylinder",
       {Option::radius, Option::length, Option::axis},
       [](Given given) -> Shape {
         return Cylinder{given.radius, given.length / 2};
       }},
      {"ring",
       {Option::radius, Option::tube_radius, Option::axis},
       [](Given given) -> Shape {
         return Ring{given.radius, given.tube_radius};
       }},
  };
  return kinds;
}

bool Solid::is_convex() const {
  return visit(shape, [](const auto& kind) { return kind.is_convex; });
}

SignedDistance signed_distance(const Solid& solid, const Eigen::Vector3d& point) {
  const Eigen::Vector3d own = solid.pose.to_own(point);
  SignedDistance gap = visit(solid.shape, [&own](const auto& kind) { return kind.distance(own); });
  gap.normal = solid.pose.turn * gap.normal;
  return gap;
}

Eigen::AlignedBox3d box_round(const Shape& shape) {
  return visit(shape, [](const auto& kind) { return kind.box(); });
}

double depth_of(const Shape& shape) {
  return visit(shape, [](const auto& kind) { return kind.depth(); });
}

Facets facets_of(const Shape& shape, double half_plane) {
  return visit(shape, [half_plane](const auto& kind) { return kind.facets(half_plane); });
}

}  // namespace pellicle::geometry
