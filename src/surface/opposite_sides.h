#pragma once

#include <petscsys.h>

#include <vector>

namespace pellicle {
inline namespace surface {

/// The side that meets each side of polygons with `count` corners each: side `count c + k` joins corners k and k + 1 of
/// polygon c. -1 if there is none. At most two sides may have the same corners.
std::vector<PetscInt> opposite_sides(const std::vector<PetscInt>& corners, std::size_t count);

}  // namespace surface
}  // namespace pellicle
