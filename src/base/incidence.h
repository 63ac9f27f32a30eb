#pragma once

#include <petscsys.h>

#include <Eigen/Core>
#include <cstddef>
#include <numeric>
#include <type_traits>
#include <vector>

#include "base/namespaces.h"

namespace pellicle::base {

/// Items, such as springs or cells, at each of some places, such as particles, in compressed rows.
struct Incidence {
  using Range = Eigen::Map<const Eigen::Matrix<PetscInt, Eigen::Dynamic, 1>>;

  std::vector<PetscInt> offsets;  ///< (places + 1)
  std::vector<PetscInt> items;    ///< numbers, ascending at each place

  /// @param places of each item: a number, or an array of them @param count number of places
  template <class Places>
  Incidence(const std::vector<Places>& places, PetscInt count) : offsets(static_cast<std::size_t>(count) + 1, 0) {
    const auto visit = [&places](const auto& take) {
      for (std::size_t item = 0; item < places.size(); ++item) {
        if constexpr (std::is_integral_v<Places>) {
          take(places[item], item);
        } else {
          for (const PetscInt place : places[item]) {
            take(place, item);
          }
        }
      }
    };
    visit([this](std::size_t place, std::size_t /*item*/) { ++offsets[place + 1]; });
    std::partial_sum(offsets.begin(), offsets.end(), offsets.begin());
    items.resize(offsets.back());
    std::vector<PetscInt> next(offsets.begin(), offsets.end() - 1);
    visit([&](std::size_t place, std::size_t item) { items[next[place]++] = static_cast<PetscInt>(item); });
  }

  Range operator[](std::size_t place) const {
    return {items.data() + offsets[place], offsets[place + 1] - offsets[place]};
  }
};

/// For each side of polygons with `count` corners, the side of the neighbour that coincides with it, or -1: side `count
/// c + k` joins corners k and k + 1 of polygon c. At most two sides may have the same corners.
std::vector<PetscInt> opposite_sides(const std::vector<PetscInt>& corners, std::size_t count);

}  // namespace pellicle::base
