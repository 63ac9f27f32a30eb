#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

#include "base/namespaces.h"

namespace pellicle::base {

/// The numbers 0 to count - 1 in sets that can be united. The lowest number of a set represents it.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0); }

  /// The number that represents the set of an item.
  std::size_t find(std::size_t item) {
    while (parent_[item] != item) {
      item = parent_[item] = parent_[parent_[item]];
    }
    return item;
  }
  void unite(std::size_t a, std::size_t b) {
    const auto [low, high] = std::minmax({find(a), find(b)});
    parent_[high] = low;
  }

 private:
  std::vector<std::size_t> parent_;
};

}  // namespace pellicle::base
