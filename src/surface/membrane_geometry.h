#pragma once

#include <Eigen/Core>
#include <array>

#include "surface/membrane.h"

namespace pellicle {
inline namespace surface {

/// Two edges of a triangle, from its first corner [m].
struct Edges {
  Eigen::Vector3d e12;
  Eigen::Vector3d e13;
};

/// @param positions of the local vertices, (3 x local) [m]
inline Edges edges_of(const double* positions, const std::array<PetscInt, 3>& triangle) {
  using Position = Eigen::Map<const Eigen::Vector3d>;
  const Position x1(positions + 3 * triangle[0]);
  return {Position(positions + 3 * triangle[1]) - x1, Position(positions + 3 * triangle[2]) - x1};
}

}  // namespace surface
}  // namespace pellicle
