#include "geometry/nearest_points.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

namespace pellicle::geometry {

namespace {

/// Share, 0 to 1, at which the point nearest to `place` lies on the segment from 0 to `side`.
double nearest_share(const Eigen::Vector3d& place, const Eigen::Vector3d& side) {
  const double square = side.squaredNorm();
  return square > 0 ? std::clamp(place.dot(side) / square, 0.0, 1.0) : 0;
}

}  // namespace

NearestPoints nearest_of_point_and_triangle(const std::array<Eigen::Vector3d, 4>& corners) {
  const auto& [point, a, b, c] = corners;
  const Eigen::Vector3d ab = b - a;
  const Eigen::Vector3d ac = c - a;
  const Eigen::Vector3d place = point - a;
  const Eigen::Vector3d normal = ab.cross(ac);
  const double square = normal.squaredNorm();
  if (square > 0) {
    const double of_b = place.cross(ac).dot(normal) / square;
    const double of_c = ab.cross(place).dot(normal) / square;
    if (of_b >= 0 && of_c >= 0 && of_b + of_c <= 1) {
      return {{1, of_b + of_c - 1, -of_b, -of_c}, place.dot(normal) / square * normal};
    }
  }
  NearestPoints nearest;
  double smallest = std::numeric_limits<double>::infinity();
  for (std::size_t side = 1; side <= 3; ++side) {
    const std::size_t next = side % 3 + 1;
    const double fraction = nearest_share(point - corners[side], corners[next] - corners[side]);
    const Eigen::Vector3d apart = point - (1 - fraction) * corners[side] - fraction * corners[next];
    if (apart.squaredNorm() < smallest) {
      smallest = apart.squaredNorm();
      nearest = {{1, 0, 0, 0}, apart};
      nearest.weights[side] = fraction - 1;
      nearest.weights[next] = -fraction;
    }
  }
  return nearest;
}

NearestPoints nearest_of_edges(const std::array<Eigen::Vector3d, 4>& corners) {
  const Eigen::Vector3d first = corners[1] - corners[0];
  const Eigen::Vector3d second = corners[3] - corners[2];
  const Eigen::Vector3d between = corners[0] - corners[2];
  const double along = first.dot(second);
  const double determinant = first.squaredNorm() * second.squaredNorm() - along * along;
  double s = 0;
  if (determinant > 0) {
    s = (along * second.dot(between) - first.dot(between) * second.squaredNorm()) / determinant;
    s = std::clamp(s, 0.0, 1.0);
  }
  const double t = nearest_share(between + s * first, second);
  s = nearest_share(t * second - between, first);
  return {{1 - s, s, t - 1, -t}, between + s * first - t * second};
}

}  // namespace pellicle::geometry
