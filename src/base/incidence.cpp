#include "base/incidence.h"

#include <algorithm>
#include <tuple>

namespace pellicle::base {

std::vector<PetscInt> opposite_sides(const std::vector<PetscInt>& corners, std::size_t count) {
  std::vector<PetscInt> lesser(corners.size());
  std::vector<PetscInt> greater(corners.size());
  for (std::size_t side = 0; side < corners.size(); ++side) {
    std::tie(lesser[side], greater[side]) =
        std::minmax({corners[side], corners[side % count + 1 < count ? side + 1 : side + 1 - count]});
  }
  const PetscInt bound = corners.empty() ? 0 : *std::max_element(lesser.begin(), lesser.end()) + 1;
  const Incidence sides_at(lesser, bound);  // few sides have the same lesser corner
  std::vector<PetscInt> opposite(corners.size(), -1);
  for (std::size_t side = 0; side < corners.size(); ++side) {
    for (const PetscInt other : sides_at[lesser[side]]) {
      if (greater[other] == greater[side] && other != static_cast<PetscInt>(side)) {
        opposite[side] = other;
      }
    }
  }
  return opposite;
}

}  // namespace pellicle::base
