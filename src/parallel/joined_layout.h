#pragma once

#include <vector>

#include "parallel/field.h"
#include "parallel/layout.h"

namespace pellicle::parallel {

/// Several layouts, the parts, joined to one, the whole. A rank has the owned items of all parts, part after part, and
/// then their ghosts in the same order: ghosts that are up to date in the parts are so in the whole.
class JoinedLayout {
 public:
  /// Collective. @param parts at least one, of the same communicator
  explicit JoinedLayout(const std::vector<Layout>& parts);

  const Layout& layout() const { return layout_; }
  std::size_t parts() const { return owned_.size(); }
  /// Local number in the whole of a local item of a part.
  PetscInt local(std::size_t part, PetscInt item) const {
    const Piece& owned = owned_[part];
    return item < owned.count ? owned.first + item : ghosts_[part].first + item - owned.count;
  }
  /// Global number in the whole of an item of a part, of any rank.
  PetscInt global(std::size_t part, PetscInt global_number) const;
  /// Local number in the whole of the first owned item of a part.
  PetscInt first_owned(std::size_t part) const { return owned_[part].first; }
  PetscInt owned(std::size_t part) const { return owned_[part].count; }  ///< number of owned items of a part

  /// Copies values of a part, ghosts included, into those of the whole. Not collective.
  void put(std::size_t part, const Field& of_part, Field& whole) const;
  /// Copies values of the whole, ghosts included, into those of a part. Not collective.
  void take(std::size_t part, const Field& whole, Field& of_part) const;

 private:
  struct Piece {
    PetscInt first = 0;  ///< local number in the whole
    PetscInt count = 0;
  };
  /// Global numbers of a rank's first item of a part.
  struct Begin {
    PetscInt in_part;
    PetscInt in_whole;
  };

  Layout layout_;
  std::vector<Piece> owned_;                ///< of each part
  std::vector<Piece> ghosts_;               ///< of each part
  std::vector<std::vector<Begin>> begins_;  ///< of each part and rank
};

}  // namespace pellicle::parallel
