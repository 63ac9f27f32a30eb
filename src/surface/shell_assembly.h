#pragma once

#include <vector>

#include "surface/distribution.h"
#include "surface/sheet.h"

namespace pellicle {
inline namespace surface {

// Makes shells of whole meshes and of remains of meshes. Internal to surface.

/// Layers of neighbours' cells on a rank: a green spring's neighbours end one cell beyond the next cell.
inline constexpr int shell_layers = 2;

/// A shell, with the points of the distribution from which its particles were made.
struct AssembledShell {
  Sheet sheet;                   ///< all but first_lattice_id and id_end
  std::vector<PetscInt> points;  ///< cell or vertex of each local particle
};

/// Makes particles, cells and springs from distributed quads with `shell_layers`, whose data are those of the lattice
/// points and corners. Collective.
AssembledShell assemble_shell(const Distribution& distribution);

}  // namespace surface
}  // namespace pellicle
