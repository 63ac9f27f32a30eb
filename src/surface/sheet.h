#pragma once

#include "surface/surface.h"

namespace pellicle::surface {

/// A distributed quad sheet: the body-centred-square shell of section 3.2.
///
/// Particles are the corner points (the mesh's vertices), then one lattice point a cell, at the mean of its corners
/// plus the thickness along the cell's normal. Local numbers: owned corners, owned lattice points, ghosts. Persistent
/// ids: the vertex number in the file, or first_lattice_id + the cell number in the file; copies of corners at cracks
/// have later ids.
struct Sheet : Surface {
  /// 2: the shell; 1: a net whose lattice points are at the mean of their cells' corners, without springs that act
  /// (surface/one_layer.h). Its springs other than the blue ones only connect pieces and conduct heat.
  int layers = 2;
  PetscInt owned_corners = 0;     ///< particles [0, owned_corners) are corners; up to `particles.owned` lattice points
  PetscInt global_corners = 0;    ///< corners of all ranks
  PetscInt first_lattice_id = 0;  ///< persistent id of the lattice point of the file's first cell

  /// Whether the springs of a colour act.
  bool acts(Colour colour) const { return layers == 2 || colour == Colour::blue; }
};

}  // namespace pellicle::surface
