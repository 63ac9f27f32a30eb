#pragma once

#include <vector>

#include "surface/active_set.h"
#include "surface/mesh_rows.h"
#include "surface/surface.h"

namespace pellicle::surface {

/// Corners of elements that are split, because cracks have separated the active elements round them.
struct SplitCorners {
  /// A particle made from a part of an owned corner.
  struct Copy {
    PetscInt original = 0;  ///< local particle
    PetscInt id = 0;        ///< persistent
    double fraction = 0;    ///< fraction of the original's masses for the copy
  };
  PetscInt count = 0;                  ///< number of copies on all ranks
  PetscInt id_end = 0;                 ///< Surface::id_end with the copies
  std::vector<Copy> copies;            ///< of this rank's corners
  std::vector<double> fraction;        ///< fraction of its masses that each owned particle keeps
  std::vector<PetscInt> cell_corners;  ///< persistent ids of the corners of the owned elements, one after the other
};

/// Finds the corners to be split. Round a corner at which a side has cracked, elements are joined across sides that
/// have not cracked and whose two surface triangles live. The group with the lowest element keeps the corner and what
/// has burnt at it; each other group gets a new particle. New ids start at Surface::id_end, in the order of the
/// corners' ids and of the groups' lowest elements, so that they do not depend on the ranks. Masses are shared in
/// proportion to those of the elements. Collective.
SplitCorners find_split_corners(const Surface& surface, const ActiveSet& active);

/// The rows of all elements of a surface with corners split. Not collective. @param copies data of the copies
MeshRows split(MeshRows rows, const SplitCorners& corners, const Records& copies);

}  // namespace pellicle::surface
