#pragma once

#include <petscvec.h>

#include <algorithm>

#include "base/error.h"

namespace pellicle {
inline namespace projection {

/// The values of this rank's rows of a vector, until the end of the scope. Not collective.
template <auto get, auto restore, class Value>
class VecValues {
 public:
  explicit VecValues(Vec vec) : vec_(vec) { check(get(vec_, &values_)); }
  ~VecValues() { restore(vec_, &values_); }
  VecValues(const VecValues&) = delete;
  VecValues& operator=(const VecValues&) = delete;
  operator Value*() const { return values_; }  // NOLINT(google-explicit-constructor)

 private:
  Vec vec_;
  Value* values_ = nullptr;
};

/// Values of a vector while it is read.
using ReadValues = VecValues<VecGetArrayRead, VecRestoreArrayRead, const double>;
/// Values of a vector while it is changed.
using ChangedValues = VecValues<VecGetArray, VecRestoreArray, double>;

/// Copies the values of the first rows of this rank. Not collective.
inline void copy_from(Vec vec, PetscInt count, double* values) {
  const ReadValues given(vec);
  std::copy_n(static_cast<const double*>(given), count, values);
}

}  // namespace projection
}  // namespace pellicle
