#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

#include "base/namespaces.h"

namespace pellicle::geometry {

/// Splits a simple polygon into triangles by cutting off ears, those with the shortest cut first, which keeps the
/// number of triangles at a corner small. A polygon in space is seen along its area vector. The cost is near n log n:
/// only corners that bend inward, found by a grid, are tested for whether they stand in an ear.
/// @param corners in order round the polygon, at least 3
/// @returns corners - 2 triangles of places in `corners`, turned like the polygon; none if the polygon crosses itself
/// or has no area.
std::vector<std::array<std::size_t, 3>> cut_ears(const std::vector<Eigen::Vector3d>& corners);

}  // namespace pellicle::geometry
