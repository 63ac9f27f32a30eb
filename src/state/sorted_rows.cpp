#include "state/sorted_rows.h"

#include <algorithm>
#include <limits>

#include "base/error.h"
#include "base/sorting.h"
#include "parallel/collective.h"

namespace pellicle::state {

namespace {

/// The rank of each id, if the range of all ids is divided into equal parts. Collective.
std::vector<int> homes_of(MPI_Comm comm, const std::vector<PetscInt>& ids) {
  const int ranks = ranks_of(comm);
  const PetscInt end = max_over_ranks(comm, ids.empty() ? 0 : *std::max_element(ids.begin(), ids.end()) + 1);
  std::vector<int> result;
  for (const PetscInt id : ids) {
    result.push_back(static_cast<int>(static_cast<long long>(id) * ranks / end));
  }
  return result;
}

/// For each wanted id the last rank whose first id is not larger. Collective.
/// @param ids of this rank's rows, which ascend over all ranks
std::vector<int> holders(MPI_Comm comm, const std::vector<PetscInt>& ids, const std::vector<PetscInt>& wanted) {
  const PetscInt none = std::numeric_limits<PetscInt>::max();
  std::vector<PetscInt> firsts = of_all_ranks(comm, std::vector<PetscInt>{ids.empty() ? none : ids.front()});
  for (std::size_t rank = firsts.size() - 1; rank-- > 0;) {  // A rank without rows begins where the next one does.
    firsts[rank] = std::min(firsts[rank], firsts[rank + 1]);
  }
  std::vector<int> result;
  for (const PetscInt id : wanted) {
    const auto beyond = std::upper_bound(firsts.begin(), firsts.end(), id);
    result.push_back(static_cast<int>(std::max<std::ptrdiff_t>(beyond - firsts.begin(), 1) - 1));
  }
  return result;
}

}  // namespace

SortedRows::SortedRows(MPI_Comm comm, const std::vector<PetscInt>& ids)
    : count_(static_cast<PetscInt>(ids.size())), route_(comm, homes_of(comm, ids)) {
  order_ = ordered_by(route_.send(ids));
}

RowsOfIds::RowsOfIds(MPI_Comm comm, const std::vector<PetscInt>& ids, const std::vector<PetscInt>& wanted)
    : count_(static_cast<PetscInt>(ids.size())), route_(comm, holders(comm, ids, wanted)) {
  const std::vector<PetscInt> asked = route_.send(wanted);
  together(comm, [&] {
    for (const PetscInt id : asked) {
      const auto place = std::lower_bound(ids.begin(), ids.end(), id);
      if (place == ids.end() || *place != id) {
        throw Error("the tables have no row of the id " + std::to_string(id));
      }
      asked_.push_back(static_cast<PetscInt>(place - ids.begin()));
    }
  });
}

}  // namespace pellicle::state
