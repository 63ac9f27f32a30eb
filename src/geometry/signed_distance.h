#pragma once

#include <Eigen/Core>

namespace pellicle {
inline namespace geometry {

/// How far a point is outside a solid (negative: inside) and which way is out.
struct SignedDistance {
  double distance = 0;     ///< [m]
  Eigen::Vector3d normal;  ///< unit vector, gradient of the distance
};

}  // namespace geometry
}  // namespace pellicle
