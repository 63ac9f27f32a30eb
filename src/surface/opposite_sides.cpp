#include "surface/opposite_sides.h"

#include <algorithm>
#include <numeric>

namespace pellicle::surface {

std::vector<PetscInt> opposite_sides(const std::vector<PetscInt>& corners, std::size_t count) {
  const auto ends = [&](std::size_t side) {
    return std::minmax({corners[side], corners[side % count + 1 < count ? side + 1 : side + 1 - count]});
  };
  // The sides by their lesser corner, where few meet.
  const PetscInt bound = corners.empty() ? 0 : *std::max_element(corners.begin(), corners.end()) + 1;
  std::vector<std::size_t> first(static_cast<std::size_t>(bound) + 1, 0);
  for (std::size_t side = 0; side < corners.size(); ++side) {
    ++first[static_cast<std::size_t>(ends(side).first) + 1];
  }
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<std::size_t> next(first.begin(), first.end());
  std::vector<std::size_t> sides(corners.size());
  std::vector<PetscInt> opposite(corners.size(), -1);
  for (std::size_t side = 0; side < corners.size(); ++side) {
    const auto [lesser, greater] = ends(side);
    for (std::size_t i = first[lesser]; i < next[lesser]; ++i) {
      if (ends(sides[i]).second == greater) {
        opposite[side] = static_cast<PetscInt>(sides[i]);
        opposite[sides[i]] = static_cast<PetscInt>(side);
      }
    }
    sides[next[lesser]++] = side;
  }
  return opposite;
}

}  // namespace pellicle::surface
