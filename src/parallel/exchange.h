#pragma once

#include <petscsf.h>

#include <algorithm>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/handle.h"
#include "parallel/layout.h"

namespace pellicle {
inline namespace parallel {

/// An MPI type of `count` consecutive values of another. Move-only.
class RowType {
 public:
  RowType() = default;
  RowType(MPI_Datatype of, int count) : type_(of) {
    if (count != 1) {  // PetscSF adds rows of numbers, and numbers, but no rows of one.
      MPI_Type_contiguous(count, of, &made_);
      MPI_Type_commit(&made_);
      type_ = made_;
    }
  }
  RowType(RowType&& other) noexcept { *this = std::move(other); }
  RowType& operator=(RowType&& other) noexcept {
    std::swap(type_, other.type_);
    std::swap(made_, other.made_);
    return *this;
  }
  RowType(const RowType&) = delete;
  RowType& operator=(const RowType&) = delete;
  ~RowType() {
    if (made_ != MPI_DATATYPE_NULL) {
      MPI_Type_free(&made_);
    }
  }
  operator MPI_Datatype() const { return type_; }  // NOLINT(google-explicit-constructor)

 private:
  MPI_Datatype type_ = MPI_DATATYPE_NULL;
  MPI_Datatype made_ = MPI_DATATYPE_NULL;
};

/// Messages between the owners of a layout's items and the ranks that have them as ghosts: one PetscSF, for values of
/// any type, in the order of the local numbers.
class GhostExchange {
 public:
  /// Collective.
  explicit GhostExchange(const Layout& layout);

  PetscInt owned() const { return owned_; }

  /// Copies the owners' values to the ghosts; the values may not change between the two calls. Several exchanges may
  /// overlap. Collective.
  /// @param type of one item's value, which occupies `bytes`
  void begin_copy(MPI_Datatype type, std::size_t bytes, void* values) const;
  void end_copy(MPI_Datatype type, std::size_t bytes, void* values) const;

  /// Combines the ghosts' values with the owners' by an MPI operation; the ghosts keep theirs. Collective.
  void combine(MPI_Datatype type, std::size_t bytes, MPI_Op operation, void* values) const;

 private:
  PetscInt owned_;
  bool is_needed_;  ///< whether any rank has ghosts
  Handle<PetscSF, PetscSFDestroy> sf_;
};

/// A copy of a field's values to the ghosts in progress, until finish().
template <class Field>
class GhostCopy;

template <class Value>
class GhostCopy<std::vector<Value>> {
 public:
  GhostCopy(const Layout& layout, std::vector<Value>& values)
      : exchange_(*layout.exchange()), values_(values), type_(MPI_BYTE, sizeof(Value)) {
    static_assert(std::is_trivially_copyable_v<Value>, "values are sent byte by byte");
    exchange_.begin_copy(type_, sizeof(Value), values_.data());
  }
  void finish() { exchange_.end_copy(type_, sizeof(Value), values_.data()); }

 private:
  const GhostExchange& exchange_;
  std::vector<Value>& values_;
  RowType type_;
};

template <>
class GhostCopy<std::vector<bool>> {
 public:
  GhostCopy(const Layout& layout, std::vector<bool>& values)
      : values_(values), bytes_(values.begin(), values.end()), copy_(layout, bytes_) {}
  void finish() {
    copy_.finish();
    std::copy(bytes_.begin(), bytes_.end(), values_.begin());
  }

 private:
  std::vector<bool>& values_;
  std::vector<char> bytes_;
  GhostCopy<std::vector<char>> copy_;
};

inline void update_ghosts(const Layout&) {}

/// Copies the owners' values to the ghosts, for any number of fields at once. Collective.
/// @param fields vectors of any plain type with a value for each local item, or a Field (parallel/field.h)
template <class First, class... Others>
void update_ghosts(const Layout& layout, First& first, Others&... others) {
  GhostCopy<First> copy(layout, first);
  update_ghosts(layout, others...);
  copy.finish();
}

/// Sets the owner's flag of an item if any of its ghosts has the flag set; the ghosts keep theirs. Collective.
/// @param flags of each local item: a type that consists of bools only
template <class Flags>
void gather_flags(const Layout& layout, std::vector<Flags>& flags) {
  static_assert(std::is_trivially_copyable_v<Flags> && sizeof(bool) == 1, "flags are combined byte by byte");
  layout.exchange()->combine(RowType(MPI_SIGNED_CHAR, sizeof(Flags)), sizeof(Flags), MPI_LOR, flags.data());
}

}  // namespace parallel
}  // namespace pellicle
