#include "parallel/layout.h"

#include <algorithm>

#include "parallel/collective.h"
#include "parallel/exchange.h"

namespace pellicle::parallel {

const std::shared_ptr<const GhostExchange>& Layout::exchange() const {
  if (made_exchange == nullptr) {
    made_exchange = std::make_shared<GhostExchange>(*this);
  }
  return made_exchange;
}

LocalNumbers::LocalNumbers(const Layout& layout) : first_(layout.first), owned_(layout.owned) {
  for (PetscInt i = layout.owned; i < layout.local(); ++i) {
    ghosts_.emplace_back(layout.to_global(i), i);
  }
  std::sort(ghosts_.begin(), ghosts_.end());
}

PetscInt LocalNumbers::find(PetscInt global) const {
  if (global >= first_ && global < first_ + owned_) {
    return global - first_;
  }
  const auto found = std::lower_bound(ghosts_.begin(), ghosts_.end(), std::pair<PetscInt, PetscInt>(global, 0));
  return found != ghosts_.end() && found->first == global ? found->second : -1;
}

Layout with_ghosts(const Layout& layout, const std::vector<PetscInt>& global_numbers) {
  Layout result = layout;
  result.ghost_global.insert(result.ghost_global.end(), global_numbers.begin(), global_numbers.end());
  result.made_exchange.reset();
  return result;
}

Layout number_owned(MPI_Comm comm, PetscInt owned) {
  Layout layout;
  layout.comm = comm;
  layout.owned = owned;
  MPI_Scan(&owned, &layout.first, 1, MPIU_INT, MPI_SUM, comm);
  layout.first -= owned;
  layout.global = sum_over_ranks(comm, owned);
  return layout;
}

}  // namespace pellicle::parallel
