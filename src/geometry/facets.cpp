#include "geometry/facets.h"

#include <cmath>

#include "geometry/pi.h"

namespace pellicle {
inline namespace geometry {

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

void add_arc(std::vector<Eigen::Vector2d>& line, const Eigen::Vector2d& centre, double radius, double from, double to) {
  constexpr int parts = 24;
  for (int i = 0; i <= parts; ++i) {
    const double angle = from + (to - from) * i / parts;
    line.push_back(centre + radius * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
  }
}

}  // namespace geometry
}  // namespace pellicle
