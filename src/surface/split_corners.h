#pragma once

#include <vector>

#include "surface/living.h"
#include "surface/surface.h"

namespace pellicle {
inline namespace surface {

/// Corners of elements that are split into several, because cracks have separated what lives round them.
struct SplitCorners {
  /// A particle that is to be made from a part of an owned corner.
  struct Copy {
    PetscInt original = 0;  ///< local particle
    PetscInt id = 0;        ///< persistent
    double share = 0;       ///< of the masses of the original that the copy gets
  };
  PetscInt count = 0;                  ///< copies, on all ranks
  PetscInt id_end = 0;                 ///< Surface::id_end with them
  std::vector<Copy> copies;            ///< of this rank's corners
  std::vector<double> share;           ///< of its masses that each owned particle keeps
  std::vector<PetscInt> cell_corners;  ///< persistent ids of the corners of the owned elements, one after the other
};

/// Finds them. Round a corner at which a side has cracked, elements are joined where they have a side in common that
/// has not cracked and of which both drawn triangles live. The joined elements with the lowest id keep the corner and
/// what has burnt at it; each other group gets a new particle. New ids start at Surface::id_end, in the order of the
/// corners' ids and of the groups' lowest elements, so that they do not depend on the ranks. Masses are shared in
/// proportion to those of the elements. Collective.
SplitCorners find_split_corners(const Surface& surface, const Living& living);

}  // namespace surface
}  // namespace pellicle
