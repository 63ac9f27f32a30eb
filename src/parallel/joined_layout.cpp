#include "parallel/joined_layout.h"

#include <algorithm>
#include <iterator>

namespace pellicle {
inline namespace parallel {

JoinedLayout::JoinedLayout(const std::vector<Layout>& parts) {
  const MPI_Comm comm = parts.front().comm;
  PetscInt owned = 0;
  for (const Layout& part : parts) {
    owned_.push_back({owned, part.owned});
    owned += part.owned;
  }
  layout_ = number_owned(comm, owned);
  int ranks = 1;
  MPI_Comm_size(comm, &ranks);
  PetscInt behind = owned;
  for (std::size_t p = 0; p < parts.size(); ++p) {
    ghosts_.push_back({behind, parts[p].ghosts()});
    behind += parts[p].ghosts();
    const PetscInt in_whole = layout_.first + owned_[p].first;
    std::vector<PetscInt>& part_begins = part_begins_.emplace_back(ranks);
    std::vector<PetscInt>& whole_begins = whole_begins_.emplace_back(ranks);
    MPI_Allgather(&parts[p].first, 1, MPIU_INT, part_begins.data(), 1, MPIU_INT, comm);
    MPI_Allgather(&in_whole, 1, MPIU_INT, whole_begins.data(), 1, MPIU_INT, comm);
  }
  for (std::size_t p = 0; p < parts.size(); ++p) {
    std::transform(parts[p].ghost_global.begin(), parts[p].ghost_global.end(), std::back_inserter(layout_.ghost_global),
                   [&](PetscInt ghost) { return global(p, ghost); });
  }
}

PetscInt JoinedLayout::global(std::size_t part, PetscInt global_number) const {
  const std::vector<PetscInt>& begins = part_begins_[part];
  const auto rank = std::upper_bound(begins.begin(), begins.end(), global_number) - begins.begin() - 1;
  return whole_begins_[part][rank] + global_number - begins[rank];
}

void JoinedLayout::put(std::size_t part, const Field& of_part, Field& whole) const {
  const auto [owned, ghosts] = std::pair(owned_[part], ghosts_[part]);
  whole.values().middleCols(owned.first, owned.count) = of_part.values().leftCols(owned.count);
  whole.values().middleCols(ghosts.first, ghosts.count) = of_part.values().middleCols(owned.count, ghosts.count);
}

void JoinedLayout::take(std::size_t part, const Field& whole, Field& of_part) const {
  const auto [owned, ghosts] = std::pair(owned_[part], ghosts_[part]);
  of_part.values().leftCols(owned.count) = whole.values().middleCols(owned.first, owned.count);
  of_part.values().middleCols(owned.count, ghosts.count) = whole.values().middleCols(ghosts.first, ghosts.count);
}

}  // namespace parallel
}  // namespace pellicle
