#pragma once

#include <Eigen/Core>

namespace pellicle {
inline namespace geometry {

/// Signed distance of a point from a solid, negative inside, with the outward direction.
struct SignedDistance {
  double distance = 0;     ///< [m]
  Eigen::Vector3d normal;  ///< unit vector, gradient of the distance
};

}  // namespace geometry
}  // namespace pellicle
