#pragma once

#include <array>
#include <vector>

#include "surface/living.h"
#include "surface/sheet.h"

namespace pellicle {
inline namespace surface {

/// Corners of a sheet's cells that become several, because cracks have parted what lives round them.
struct SplitCorners {
  /// A particle that is to be made of a part of an owned corner.
  struct Copy {
    PetscInt original = 0;  ///< local particle
    PetscInt id = 0;        ///< persistent
    double share = 0;       ///< of the masses of the original
  };
  PetscInt count = 0;                                 ///< copies, on all ranks
  PetscInt id_end = 0;                                ///< Sheet::id_end with them
  std::vector<Copy> copies;                           ///< of this rank's corners
  std::vector<double> share;                          ///< of its masses that each owned corner keeps
  std::vector<std::array<PetscInt, 4>> cell_corners;  ///< persistent ids of the corners of the owned cells
};

/// Finds them. Round a corner at which a side has cracked, cells are joined where they have a side in common that has
/// not, and of which both drawn triangles live. The joined cells with the lowest id keep the corner and what has burnt
/// at it; each other group gets a new particle. New ids follow on Sheet::id_end, in the order of the corners' ids and
/// of the groups' lowest cells, so that they do not depend on the ranks. Masses are shared as those of the cells are.
/// Collective.
SplitCorners find_split_corners(const Sheet& sheet, const Living& living);

}  // namespace surface
}  // namespace pellicle
