#pragma once

#include <array>
#include <vector>

#include "surface/point_set.h"

namespace pellicle {

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
  /// Drawn triangles that share each local spring: two of its cell for a red one, those at its edge for a blue one and
  /// at the edge that it crosses for a green one, all four of its cell for a yellow one. -1 where there is none, or
  /// where it is not local, which happens to ghosts only.
  std::vector<std::array<PetscInt, 4>> triangles;

  PetscInt owned() const { return layout.owned; }
  PetscInt local() const { return layout.local(); }
};

/// A distributed quad sheet: the body-centred-square shell of section 3.2, as flat arrays.
///
/// Particles are the corner points (the mesh's vertices), then one lattice point a cell, at the mean of its corners
/// plus the thickness along the cell's normal. Local numbers: owned corners, owned lattice points, ghosts. Persistent
/// ids: the vertex number in the file, or first_lattice_id + the cell number in the file.
struct Sheet : PointSet {
  PetscInt owned_corners = 0;     ///< particles [0, owned_corners) are corners; up to `particles.owned` lattice points
  PetscInt global_corners = 0;    ///< corners of all ranks
  PetscInt global_cells = 0;      ///< cells of all ranks
  PetscInt first_lattice_id = 0;  ///< persistent id of the lattice point of the file's first cell
  PetscInt id_end = 0;            ///< all persistent ids are smaller, also those of cells that were removed
  std::vector<double> initial_mass;  ///< m^init of the local particles [kg]

  /// Cells whose corners and lattice point are local; owned cells come first. Local particle numbers, round the cell.
  /// Drawn triangle 4 c + k of cell c joins its corners k and k + 1 with its centre.
  std::vector<std::array<PetscInt, 4>> cells;
  std::vector<PetscInt> lattice;  ///< lattice particle of each cell
  PetscInt owned_cells = 0;

  std::array<SpringSet, 4> springs;  ///< by Colour

  SpringSet& of(Colour colour) { return springs[static_cast<std::size_t>(colour)]; }
  const SpringSet& of(Colour colour) const { return springs[static_cast<std::size_t>(colour)]; }
};

}  // namespace pellicle
