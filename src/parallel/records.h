#pragma once

#include <petscsys.h>

#include <algorithm>
#include <cstddef>
#include <type_traits>
#include <vector>

#include "base/namespaces.h"

namespace pellicle::parallel {

/// Records of equal numbers of bytes, one for each item: uninterpreted data that move with particles and cells.
class Records {
 public:
  Records() = default;
  /// Records of zeros.
  /// @param bytes of a record; may be 0
  Records(std::size_t bytes, PetscInt count)
      : bytes_(bytes), count_(count), data_(bytes * static_cast<std::size_t>(count)) {}

  /// The records of values of a plain type.
  /// @param count of the records, each of `values_each` values
  template <class Value>
  static Records of(const std::vector<Value>& values, PetscInt count, std::size_t values_each = 1) {
    static_assert(std::is_trivially_copyable_v<Value>, "a record is copied byte by byte");
    Records records(sizeof(Value) * values_each, count);
    std::copy_n(reinterpret_cast<const std::byte*>(values.data()), records.data_.size(), records.data_.begin());
    return records;
  }
  template <class Value>
  static Records of(const std::vector<Value>& values) {
    return of(values, static_cast<PetscInt>(values.size()));
  }

  /// The records as values of a plain type.
  template <class Value>
  std::vector<Value> as() const {
    static_assert(std::is_trivially_copyable_v<Value>, "a record is copied byte by byte");
    std::vector<Value> values(data_.size() / sizeof(Value));
    std::copy(data_.begin(), data_.end(), reinterpret_cast<std::byte*>(values.data()));
    return values;
  }

  std::size_t bytes() const { return bytes_; }
  PetscInt count() const { return count_; }
  std::byte* at(PetscInt item) { return data_.data() + static_cast<std::size_t>(item) * bytes_; }
  const std::byte* at(PetscInt item) const { return data_.data() + static_cast<std::size_t>(item) * bytes_; }
  const std::vector<std::byte>& data() const { return data_; }

  /// The records of some items, in this order; an item may be named more than once.
  Records of_items(const std::vector<PetscInt>& items) const {
    Records chosen(bytes_, static_cast<PetscInt>(items.size()));
    std::byte* to = chosen.data_.data();
    for (const PetscInt item : items) {
      to = std::copy_n(at(item), bytes_, to);
    }
    return chosen;
  }
  /// Adds records of the same size behind these.
  void append(const Records& others) {
    count_ += others.count_;
    data_.insert(data_.end(), others.data_.begin(), others.data_.end());
  }

 private:
  std::size_t bytes_ = 0;
  PetscInt count_ = 0;
  std::vector<std::byte> data_;  ///< record after record
};

}  // namespace pellicle::parallel
