#include "parallel/layout.h"

#include "parallel/exchange.h"

namespace pellicle {
inline namespace parallel {

const std::shared_ptr<const GhostExchange>& Layout::exchange() const {
  if (made_exchange == nullptr) {
    made_exchange = std::make_shared<GhostExchange>(*this);
  }
  return made_exchange;
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
  MPI_Allreduce(&owned, &layout.global, 1, MPIU_INT, MPI_SUM, comm);
  return layout;
}

}  // namespace parallel
}  // namespace pellicle
