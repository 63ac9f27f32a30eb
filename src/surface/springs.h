#pragma once

#include <array>
#include <vector>

#include "parallel/layout.h"

namespace pellicle {
inline namespace surface {

/// The four sets of springs of the body-centred-square shell (burning paper, section 3.2), in the order of projection.
enum class Colour { red = 0, green = 1, blue = 2, yellow = 3 };
inline constexpr std::array<Colour, 4> all_colours{Colour::red, Colour::green, Colour::blue, Colour::yellow};
inline constexpr std::array<const char*, 4> colour_names{"red", "green", "blue", "yellow"};

/// The springs of one colour. Local numbers run over owned springs, then ghosts: springs of other ranks that end at a
/// particle of this rank, share a particle with an owned spring, or lie in a cell of this rank. Both ends of every
/// local spring are local particles.
struct SpringSet {
  Layout layout;
  std::vector<std::array<PetscInt, 2>> ends;  ///< local particle numbers
  std::vector<double> initial_length;         ///< l^init [m]
  /// Surface triangles that share each local spring: two of its cell for a red one, those at its edge for a blue one,
  /// those at the edge that it crosses for a green one, all four of its cell for a yellow one. -1: none, or for ghosts
  /// also one that is not local.
  std::vector<std::array<PetscInt, 4>> triangles;

  PetscInt owned() const { return layout.owned; }
  PetscInt local() const { return layout.local(); }
};

}  // namespace surface
}  // namespace pellicle
