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
KeptPart marching_triangle(const std::array<double, 3>& level);

}  // namespace pellicle::geometry
