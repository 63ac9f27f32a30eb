#pragma once

#include <petscsf.h>

#include <algorithm>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/handle.h"
#include "parallel/layout.h"

namespace pellicle::parallel {

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

  /// Copies the owners' values to the ghosts. Collective. @param type of one item's value, which occupies `bytes`
  void copy(MPI_Datatype type, std::size_t bytes, void* values) const;

  /// Combines the ghosts' values with the owners' by an MPI operation; the ghosts keep theirs. Collective.
  void combine(MPI_Datatype type, std::size_t bytes, MPI_Op operation, void* values) const;

 private:
  PetscInt owned_;
  Handle<PetscSF, PetscSFDestroy> sf_;  ///< null: no rank has ghosts
};

/// Copies the owners' values to the ghosts. Collective.
/// @param values of any plain type, one for each local item
template <class Value>
void update_ghosts(const Layout& layout, std::vector<Value>& values) {
  static_assert(std::is_trivially_copyable_v<Value>, "values are sent byte by byte");
  layout.exchange()->copy(RowType(MPI_BYTE, sizeof(Value)), sizeof(Value), values.data());
}
/// @param each number of consecutive values of an item
inline void update_ghosts(const Layout& layout, std::vector<bool>& values, std::size_t each = 1) {
  std::vector<char> bytes(values.begin(), values.end());
  layout.exchange()->copy(RowType(MPI_BYTE, static_cast<int>(each)), each, bytes.data());
  std::copy(bytes.begin(), bytes.end(), values.begin());
}

/// Sets the owner's flag of an item if any of its ghosts has the flag set; the ghosts keep theirs. Collective.
/// @param flags of each local item: a char, or a type that consists of bools only
template <class Flags>
void gather_flags(const Layout& layout, std::vector<Flags>& flags) {
  static_assert(std::is_trivially_copyable_v<Flags> && sizeof(bool) == 1, "flags are combined byte by byte");
  layout.exchange()->combine(RowType(MPI_SIGNED_CHAR, sizeof(Flags)), sizeof(Flags), MPI_LOR, flags.data());
}

}  // namespace pellicle::parallel
