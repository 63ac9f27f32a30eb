#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "parallel/field.h"
#include "surface/surface.h"

namespace pellicle {
inline namespace contact {

/// Where a drawn surface passes through itself.
struct Crossings {
  int pairs = 0;                       ///< of triangles
  std::array<PetscInt, 2> elements{};  ///< of the first of them, by their numbers in the file
  Eigen::Vector3d place{0, 0, 0};      ///< where the first of these two is [m]
};

/// Counts the pairs of drawn triangles without a common corner that cut through each other, all on rank 0, by a test
/// that has nothing in common with SurfaceContact (count_self_intersections). Collective.
/// @param living of the surface's drawn triangles; null: all of them
Crossings find_crossings(const Surface& surface, const Field& x, const std::vector<bool>* living);

}  // namespace contact
}  // namespace pellicle
