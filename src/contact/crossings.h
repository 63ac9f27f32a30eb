#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "geometry/triangle_intersection.h"
#include "parallel/field.h"
#include "surface/surface.h"

namespace pellicle {
inline namespace contact {

/// Where drawn surfaces pass through themselves or each other, or touch.
struct Crossings {
  int pairs = 0;                       ///< of triangles that cut through each other
  int touching = 0;                    ///< of triangles that do not, but touch, see find_crossings
  std::array<PetscInt, 2> elements{};  ///< of the first of all these, by their numbers in the file
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
/// @param touch distance from which on other pairs of triangles do not touch [m]; 0: none is looked for. A corner and a
/// triangle, or two edges, touch, and so do two triangles of which one lies on the other; where corners are in one
/// place, as on both sides of a slit, that alone does not count.
Crossings find_crossings(const std::vector<PlacedSurface>& surfaces, double touch = 0);

/// Whether two triangles touch, see find_crossings.
bool triangles_touch(const Triangle& first, const Triangle& second, double touch);

/// Counts those pairs of triangles that cut through each other and did not before. Collective.
/// @param before the same triangles at other places
Crossings find_new_crossings(const std::vector<PlacedSurface>& before, const std::vector<PlacedSurface>& surfaces);

/// "3 pairs of triangles pass through each other, first of elements 4 and 9 at (1, 0, 2) m". @param names of the
/// objects whose surfaces were examined; empty ones are not said
std::string crossing_words(const Crossings& crossings, const std::vector<std::string>& names);

}  // namespace contact
}  // namespace pellicle
