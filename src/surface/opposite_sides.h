#pragma once

#include <petscsys.h>

#include <vector>

#include "base/namespaces.h"

namespace pellicle::surface {

/// For each side of polygons with `count` corners, the side of the neighbour that coincides with it, or -1: side `count
/// c + k` joins corners k and k + 1 of polygon c. At most two sides may have the same corners.
std::vector<PetscInt> opposite_sides(const std::vector<PetscInt>& corners, std::size_t count);

}  // namespace pellicle::surface
