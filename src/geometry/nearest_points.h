#pragma once

#include <Eigen/Core>
#include <array>

#include "base/namespaces.h"

namespace pellicle::geometry {

/// The nearest points of two features with four corners p_a in all.
struct NearestPoints {
  /// sum_a w_a p_a goes from the second feature's nearest point to the first one's: weights of the first feature sum up
  /// to 1, those of the second to -1.
  std::array<double, 4> weights{};
  Eigen::Vector3d apart = Eigen::Vector3d::Zero();  ///< sum_a w_a p_a [m]
};

/// @param corners the point, then the corners of the triangle, which may be degenerate
NearestPoints nearest_of_point_and_triangle(const std::array<Eigen::Vector3d, 4>& corners);

/// @param corners ends of the first edge, then of the second; an edge may be a point, both may be parallel
NearestPoints nearest_of_edges(const std::array<Eigen::Vector3d, 4>& corners);

}  // namespace pellicle::geometry
