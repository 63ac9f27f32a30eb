#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "parallel/field.h"
#include "surface/surface.h"

namespace pellicle {
inline namespace contact {

/// Where drawn surfaces pass through themselves or each other.
struct Crossings {
  int pairs = 0;                       ///< of triangles
  std::array<PetscInt, 2> elements{};  ///< of the first of them, by their numbers in the file
  std::array<int, 2> surfaces{};       ///< of which surfaces these are
  Eigen::Vector3d place{0, 0, 0};      ///< where the first of these two is [m]
};

/// A surface that is examined.
struct PlacedSurface {
  const Surface& surface;
  const Field& position;
  const std::vector<bool>* living;  ///< of its drawn triangles; null: all of them
};

/// Counts the pairs of drawn triangles without a common corner that cut through each other, all on rank 0, by a test
/// that has nothing in common with SurfaceContact (count_self_intersections). Collective.
/// @param surfaces at least one
Crossings find_crossings(const std::vector<PlacedSurface>& surfaces);

}  // namespace contact
}  // namespace pellicle
