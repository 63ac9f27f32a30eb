#pragma once

#include <vector>

#include "surface/distribution.h"
#include "surface/sheet.h"

namespace pellicle {
inline namespace surface {

// Makes shells, of whole meshes and of what is left of one. Internal to surface.

/// Neighbours' cells that a rank needs: a green spring's neighbours end one cell beyond the next cell.
inline constexpr int shell_layers = 2;

/// A shell, and where its particles were in the distribution from which it was made.
struct AssembledShell {
  Sheet sheet;                   ///< all but first_lattice_id and id_end
  std::vector<PetscInt> points;  ///< cell or vertex of each local particle
};

/// Makes particles, cells and springs from distributed quads with `shell_layers`, whose data are those of the lattice
/// points and corners. Collective.
AssembledShell assemble_shell(const Distribution& distribution);

}  // namespace surface
}  // namespace pellicle
