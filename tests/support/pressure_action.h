#pragma once

#include <Eigen/Core>
#include <array>

#include "geometry/pressure_load.h"

namespace pellicle {

/// Adds what add_pressure_stiffness_action gives for one triangle of a surface, of points, displacements and forces of
/// the surface, (3 x points) each.
inline void add_pressure_stiffness_action(double pressure, const std::array<int, 3>& triangle,
                                          const Eigen::Ref<const Eigen::Matrix3Xd>& x,
                                          const Eigen::Ref<const Eigen::Matrix3Xd>& w, Eigen::Matrix3Xd& result) {
  const auto [a, b, c] = triangle;
  const std::array<Eigen::Vector3d, 3> corners{x.col(a), x.col(b), x.col(c)};
  const std::array<Eigen::Vector3d, 3> displacements{w.col(a), w.col(b), w.col(c)};
  std::array<Eigen::Vector3d, 3> forces{result.col(a), result.col(b), result.col(c)};
  add_pressure_stiffness_action(pressure, corners.data(), displacements.data(), forces.data());
  result.col(a) = forces[0];
  result.col(b) = forces[1];
  result.col(c) = forces[2];
}

}  // namespace pellicle
