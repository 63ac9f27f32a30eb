#pragma once

#include <array>

#include "base/namespaces.h"

namespace pellicle::geometry {

/// A point on the border of a triangle: its corner `from`, or a point between two corners.
struct BorderPoint {
  int from = 0;  ///< a corner with level >= 0
  int to = 0;    ///< a corner with level < 0, or `from`
  double t = 0;  ///< fraction of the way from `from` to `to`: m'_0 / (m'_0 - m'_1) (burning paper, eq. 7)
};

/// The part of a triangle in which a linear level is not negative: none, one or two triangles, turned as the whole.
struct KeptPart {
  int count = 0;
  std::array<std::array<BorderPoint, 3>, 2> triangles;
};

/// Marching triangles (burning paper, Fig. 6). @param level at the three corners
inline KeptPart marching_triangle(const std::array<double, 3>& level) {
  const auto kept = [&level](int corner) { return level[corner] >= 0; };
  const auto cut = [&level](int from, int to) {
    const double m0 = level[from];
    const double m1 = level[to];
    return BorderPoint{from, to, m0 / (m0 - m1)};
  };
  const auto whole = [](int corner) { return BorderPoint{corner, corner, 0}; };
  const int kept_corners = kept(0) + kept(1) + kept(2);
  if (kept_corners == 0) {
    return {};
  }
  if (kept_corners == 3) {
    return {1, {{{whole(0), whole(1), whole(2)}, {}}}};
  }
  // Corner a is kept, the one before it is not.
  const int a = kept(0) && !kept(2) ? 0 : kept(1) && !kept(0) ? 1 : 2;
  const int b = (a + 1) % 3;
  const int c = (a + 2) % 3;
  if (kept_corners == 1) {
    return {1, {{{whole(a), cut(a, b), cut(a, c)}, {}}}};
  }
  return {2, {{{whole(a), whole(b), cut(b, c)}, {whole(a), cut(b, c), cut(a, c)}}}};
}

}  // namespace pellicle::geometry
