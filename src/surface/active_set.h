#pragma once

#include <array>
#include <vector>

#include "surface/surface.h"

namespace pellicle::surface {

/// The active parts of a surface that burns or tears, without renumbering: springs that hold, and surface triangles
/// that exist at least in part. A spring lives as long as one of the triangles that share it; a green one dies when the
/// side that it crosses cracks. SpringRule has further criteria.
struct ActiveSet {
  /// Everything is active.
  explicit ActiveSet(const Surface& surface)
      : triangles(surface.triangles.size(), true),
        cracked(static_cast<std::size_t>(surface.sides_per_element() * surface.elements.local()), false) {
    for (std::size_t colour = 0; colour < springs.size(); ++colour) {
      springs[colour].assign(surface.springs[colour].ends.size(), true);
    }
  }

  std::array<std::vector<bool>, 4> springs;  ///< local springs of each colour, ghosts up to date
  std::vector<bool> triangles;               ///< drawn ones of the local elements, ghosts up to date
  /// Sides of the local elements along which the surface has cracked; both elements at a side have the same value.
  /// Ghosts up to date.
  std::vector<bool> cracked;
};

/// Calls `take` with the ends of each active local spring.
template <class Take>
void for_each_active_spring(const Surface& surface, const ActiveSet& active, const Take& take) {
  for (std::size_t colour = 0; colour < all_colours.size(); ++colour) {
    const std::vector<std::array<PetscInt, 2>>& ends = surface.springs[colour].ends;
    for (std::size_t s = 0; s < ends.size(); ++s) {
      if (active.springs[colour][s]) {
        take(ends[s]);
      }
    }
  }
}

/// Whether each local particle has an active local spring; all springs of owned particles are local. Not collective.
inline std::vector<bool> particles_with_springs(const Surface& surface, const ActiveSet& active) {
  std::vector<bool> result(surface.particles.local(), false);
  for_each_active_spring(surface, active, [&result](const std::array<PetscInt, 2>& ends) {
    result[ends[0]] = true;
    result[ends[1]] = true;
  });
  return result;
}

}  // namespace pellicle::surface
