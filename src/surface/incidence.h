#pragma once

#include <petscsys.h>

#include <array>
#include <cstddef>
#include <numeric>
#include <vector>

#include "base/namespaces.h"

namespace pellicle::surface {

/// Springs or cells at each local particle, in compressed rows.
struct Incidence {
  struct Range {
    const PetscInt* first;
    const PetscInt* last;
    const PetscInt* begin() const { return first; }
    const PetscInt* end() const { return last; }
    PetscInt size() const { return static_cast<PetscInt>(last - first); }
    PetscInt operator[](PetscInt i) const { return first[i]; }
  };

  std::vector<PetscInt> offsets;  ///< (particles + 1)
  std::vector<PetscInt> items;    ///< local numbers, ascending at each particle

  /// @param corners local particles of each item @param particles number of local particles
  template <std::size_t count>
  Incidence(const std::vector<std::array<PetscInt, count>>& corners, PetscInt particles)
      : offsets(static_cast<std::size_t>(particles) + 1, 0), items(count * corners.size()) {
    for (const auto& of_item : corners) {
      for (const PetscInt corner : of_item) {
        ++offsets[static_cast<std::size_t>(corner) + 1];
      }
    }
    std::partial_sum(offsets.begin(), offsets.end(), offsets.begin());
    std::vector<PetscInt> next(offsets.begin(), offsets.end() - 1);
    for (std::size_t item = 0; item < corners.size(); ++item) {
      for (const PetscInt corner : corners[item]) {
        items[next[corner]++] = static_cast<PetscInt>(item);
      }
    }
  }

  Range operator[](PetscInt particle) const {
    const std::size_t i = particle;
    return {items.data() + offsets[i], items.data() + offsets[i + 1]};
  }
};

}  // namespace pellicle::surface
