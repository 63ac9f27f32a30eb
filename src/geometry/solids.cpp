#include "geometry/solids.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pellicle {
inline namespace geometry {

namespace {

/// The unit vector along a vector, or `otherwise` if the vector is 0.
Eigen::Vector3d direction_of(const Eigen::Vector3d& vector, double length, const Eigen::Vector3d& otherwise) {
  return length > 0 ? Eigen::Vector3d(vector / length) : otherwise;
}

Eigen::Vector3d away_from_axis(const Eigen::Vector3d& point, double distance) {
  return direction_of({point.x(), point.y(), 0}, distance, Eigen::Vector3d::UnitX());
}

double sign_of(double value) { return value < 0 ? -1 : 1; }

}  // namespace

SignedDistance signed_distance(const Sphere& sphere, const Eigen::Vector3d& point) {
  const double length = point.norm();
  return {length - sphere.radius, direction_of(point, length, Eigen::Vector3d::UnitZ())};
}

SignedDistance signed_distance(const HalfSpace&, const Eigen::Vector3d& point) {
  return {point.z(), Eigen::Vector3d::UnitZ()};
}

SignedDistance signed_distance(const Box& box, const Eigen::Vector3d& point) {
  const Eigen::Vector3d beyond = point.cwiseAbs() - box.half;
  Eigen::Index axis = 0;
  const double most = beyond.maxCoeff(&axis);
  if (most <= 0) {
    return {most, sign_of(point[axis]) * Eigen::Vector3d::Unit(axis)};
  }
  Eigen::Vector3d arm = beyond.cwiseMax(0);
  const double length = arm.norm();
  for (Eigen::Index k = 0; k < 3; ++k) {
    arm[k] *= sign_of(point[k]);
  }
  return {length, arm / length};
}

SignedDistance signed_distance(const Capsule& capsule, const Eigen::Vector3d& point) {
  const Eigen::Vector3d arm = point - Eigen::Vector3d(0, 0, std::clamp(point.z(), -capsule.half, capsule.half));
  const double length = arm.norm();
  return {length - capsule.radius, direction_of(arm, length, Eigen::Vector3d::UnitX())};
}

SignedDistance signed_distance(const Cylinder& cylinder, const Eigen::Vector3d& point) {
  const double from_axis = std::hypot(point.x(), point.y());
  const Eigen::Vector3d sideways = away_from_axis(point, from_axis);
  const Eigen::Vector3d upward = sign_of(point.z()) * Eigen::Vector3d::UnitZ();
  const double beyond_side = from_axis - cylinder.radius;
  const double beyond_end = std::abs(point.z()) - cylinder.half;
  if (beyond_side <= 0 || beyond_end <= 0) {
    return beyond_side > beyond_end ? SignedDistance{beyond_side, sideways} : SignedDistance{beyond_end, upward};
  }
  const double length = std::hypot(beyond_side, beyond_end);
  return {length, (beyond_side * sideways + beyond_end * upward) / length};
}

SignedDistance signed_distance(const Ring& ring, const Eigen::Vector3d& point) {
  const double from_axis = std::hypot(point.x(), point.y());
  const Eigen::Vector3d sideways = away_from_axis(point, from_axis);
  const Eigen::Vector3d arm = point - ring.radius * sideways;
  const double length = arm.norm();
  return {length - ring.tube, direction_of(arm, length, Eigen::Vector3d::UnitZ())};
}

SignedDistance signed_distance(const std::shared_ptr<const ClosedMesh>& mesh, const Eigen::Vector3d& point) {
  return mesh->signed_distance(point);
}

SignedDistance signed_distance(const Solid& solid, const Eigen::Vector3d& point) {
  const Eigen::Vector3d own = solid.pose.to_own(point);
  SignedDistance gap = std::visit([&own](const auto& shape) { return signed_distance(shape, own); }, solid.shape);
  gap.normal = solid.pose.turn * gap.normal;
  return gap;
}

Eigen::AlignedBox3d box_round(const Shape& shape) {
  struct Round {
    static Eigen::AlignedBox3d of(const Eigen::Vector3d& half) { return {-half, half}; }
    static Eigen::AlignedBox3d of(double sideways, double upward) { return of({sideways, sideways, upward}); }

    Eigen::AlignedBox3d operator()(const Sphere& sphere) const { return of(sphere.radius, sphere.radius); }
    Eigen::AlignedBox3d operator()(const HalfSpace&) const {
      constexpr double far = std::numeric_limits<double>::infinity();
      return {Eigen::Vector3d::Constant(-far), Eigen::Vector3d(far, far, 0)};
    }
    Eigen::AlignedBox3d operator()(const Box& box) const { return of(box.half); }
    Eigen::AlignedBox3d operator()(const Capsule& capsule) const {
      return of(capsule.radius, capsule.half + capsule.radius);
    }
    Eigen::AlignedBox3d operator()(const Cylinder& cylinder) const { return of(cylinder.radius, cylinder.half); }
    Eigen::AlignedBox3d operator()(const Ring& ring) const { return of(ring.radius + ring.tube, ring.tube); }
    Eigen::AlignedBox3d operator()(const std::shared_ptr<const ClosedMesh>& mesh) const { return mesh->box(); }
  };
  return std::visit(Round{}, shape);
}

double depth_of(const Shape& shape) {
  struct Depth {
    double operator()(const Sphere& sphere) const { return sphere.radius; }
    double operator()(const HalfSpace&) const { return std::numeric_limits<double>::infinity(); }
    double operator()(const Box& box) const { return box.half.minCoeff(); }
    double operator()(const Capsule& capsule) const { return capsule.radius; }
    double operator()(const Cylinder& cylinder) const { return std::min(cylinder.radius, cylinder.half); }
    double operator()(const Ring& ring) const { return ring.tube; }
    double operator()(const std::shared_ptr<const ClosedMesh>&) const { return 0; }
  };
  return std::visit(Depth{}, shape);
}

}  // namespace geometry
}  // namespace pellicle
