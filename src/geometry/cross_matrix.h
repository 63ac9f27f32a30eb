#pragma once

#include <Eigen/Core>

#include "base/namespaces.h"

namespace pellicle::geometry {

/// The matrix of v x.
inline Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  return Eigen::Matrix3d{{0, -v[2], v[1]}, {v[2], 0, -v[0]}, {-v[1], v[0], 0}};
}

}  // namespace pellicle::geometry
