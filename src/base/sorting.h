#pragma once

#include <petscsys.h>

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

#include "base/namespaces.h"

namespace pellicle::base {

/// The numbers 0, 1, 2, ..., of which there are `count`.
template <class Number = int>
std::vector<Number> numbers_up_to(std::size_t count) {
  std::vector<Number> numbers(count);
  std::iota(numbers.begin(), numbers.end(), Number{0});
  return numbers;
}

/// The numbers 0, 1, ... of items, ordered by their keys.
template <class Key>
std::vector<PetscInt> ordered_by(const std::vector<Key>& keys) {
  std::vector<PetscInt> items = numbers_up_to<PetscInt>(keys.size());
  std::sort(items.begin(), items.end(), [&keys](PetscInt a, PetscInt b) { return keys[a] < keys[b]; });
  return items;
}

/// The distinct values in ascending order.
template <class Value>
std::vector<Value> without_repeats(std::vector<Value> values) {
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  return values;
}

/// The first of some items for which `is` holds; null: none.
template <class Items, class Is>
auto* first_that(Items& items, const Is& is) {
  const auto found = std::find_if(items.begin(), items.end(), is);
  return found == items.end() ? nullptr : &*found;
}

}  // namespace pellicle::base
