#pragma once

#include <array>
#include <vector>

#include "surface/surface.h"

namespace pellicle {
inline namespace surface {

/// What is left of a surface that burns or tears, without renumbering it: the springs that still hold and the drawn
/// triangles that are still there, at least in part. A spring lives as long as one of the triangles that share it; a
/// green one dies when the side that it crosses cracks. See SpringRule for what else kills one.
struct Living {
  /// At first everything lives.
  explicit Living(const Surface& surface);

  std::array<std::vector<bool>, 4> springs;  ///< local springs of each colour, ghosts up to date
  std::vector<bool> triangles;               ///< drawn ones of the local elements, ghosts up to date
  /// Sides of the local elements along which the surface has cracked; both elements at a side have the same value.
  /// Ghosts up to date.
  std::vector<bool> cracked;
};

/// Which local particles have a local spring that lives; all springs of owned particles are local. Not collective.
std::vector<bool> particles_with_springs(const Surface& surface, const Living& living);

}  // namespace surface
}  // namespace pellicle
