#pragma once

#include <Eigen/Geometry>

namespace pellicle {
inline namespace geometry {

/// Area times normal of a quad with these corners round it, which may be warped: half the cross product of its
/// diagonals [m^2].
inline Eigen::Vector3d quad_area_vector(const Eigen::Vector3d& x0, const Eigen::Vector3d& x1, const Eigen::Vector3d& x2,
                                        const Eigen::Vector3d& x3) {
  return 0.5 * (x2 - x0).cross(x3 - x1);
}

}  // namespace geometry
}  // namespace pellicle
