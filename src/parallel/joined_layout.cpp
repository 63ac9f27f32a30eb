#include "parallel/joined_layout.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "parallel/collective.h"

namespace pellicle::parallel {

JoinedLayout::JoinedLayout(const std::vector<Layout>& parts) {
  const MPI_Comm comm = parts.front().comm;
  PetscInt owned = 0;
  for (const Layout& part : parts) {
    owned_.push_back({owned, part.owned});
    owned += part.owned;
  }
  layout_ = number_owned(comm, owned);
  PetscInt behind = owned;
  for (std::size_t p = 0; p < parts.size(); ++p) {
    ghosts_.push_back({behind, parts[p].ghosts()});
    behind += parts[p].ghosts();
    begins_.push_back(of_all_ranks(comm, std::vector<Begin>{{parts[p].first, layout_.first + owned_[p].first}}));
  }
  for (std::size_t p = 0; p < parts.size(); ++p) {
    std::transform(parts[p].ghost_global.begin(), parts[p].ghost_global.end(), std::back_inserter(layout_.ghost_global),
                   [&](PetscInt ghost) { return global(p, ghost); });
  }
}

PetscInt JoinedLayout::global(std::size_t part, PetscInt global_number) const {
  const std::vector<Begin>& begins = begins_[part];
  const auto next = std::upper_bound(begins.begin(), begins.end(), global_number,
                                     [](PetscInt number, const Begin& begin) { return number < begin.in_part; });
  const Begin& of_rank = *std::prev(next);
  return of_rank.in_whole + global_number - of_rank.in_part;
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

}  // namespace pellicle::parallel
