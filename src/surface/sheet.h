#pragma once

#include "surface/surface.h"

namespace pellicle {
inline namespace surface {

/// A distributed quad sheet: the body-centred-square shell of section 3.2.
///
/// Particles are the corner points (the mesh's vertices), then one lattice point a cell, at the mean of its corners
/// plus the thickness along the cell's normal. Local numbers: owned corners, owned lattice points, ghosts. Persistent
/// ids: the vertex number in the file, or first_lattice_id + the cell number in the file.
struct Sheet : Surface {
  PetscInt owned_corners = 0;     ///< particles [0, owned_corners) are corners; up to `particles.owned` lattice points
  PetscInt global_corners = 0;    ///< corners of all ranks
  PetscInt first_lattice_id = 0;  ///< persistent id of the lattice point of the file's first cell
};

}  // namespace surface
}  // namespace pellicle
