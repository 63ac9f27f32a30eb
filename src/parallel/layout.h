#pragma once

#include <petscvec.h>

#include <memory>
#include <utility>
#include <vector>

#include "base/namespaces.h"

namespace pellicle::parallel {

class GhostExchange;

/// A distributed numbering of items with their owners. Local numbers run over owned items, then ghosts; the global
/// number of owned item i is `first + i`.
struct Layout {
  MPI_Comm comm = MPI_COMM_NULL;
  PetscInt owned = 0;                  ///< items of this rank
  PetscInt first = 0;                  ///< global number of this rank's first item
  PetscInt global = 0;                 ///< items of all ranks
  std::vector<PetscInt> ghost_global;  ///< global numbers of the ghosts, which other ranks own

  PetscInt ghosts() const { return static_cast<PetscInt>(ghost_global.size()); }
  PetscInt local() const { return owned + ghosts(); }
  PetscInt to_global(PetscInt local_number) const {
    return local_number < owned ? first + local_number : ghost_global[local_number - owned];
  }

  /// The messages between owners and ghosts (parallel/exchange.h), made by the first call, after which the layout may
  /// not change. Collective.
  const std::shared_ptr<const GhostExchange>& exchange() const;

  mutable std::shared_ptr<const GhostExchange> made_exchange;  ///< made by exchange(), or null
};

/// Local numbers of a layout by the global ones.
class LocalNumbers {
 public:
  LocalNumbers() = default;
  explicit LocalNumbers(const Layout& layout);

  /// Local number of an item; -1: neither owned nor a ghost.
  PetscInt find(PetscInt global) const;

 private:
  PetscInt first_ = 0;
  PetscInt owned_ = 0;
  std::vector<std::pair<PetscInt, PetscInt>> ghosts_;  ///< global and local number, sorted
};

/// A layout with further ghosts, which come last. @param global_numbers other ranks' items that are no ghosts yet
Layout with_ghosts(const Layout& layout, const std::vector<PetscInt>& global_numbers);

/// A layout without ghosts of which this rank owns `owned` items. Collective.
Layout number_owned(MPI_Comm comm, PetscInt owned);

}  // namespace pellicle::parallel
