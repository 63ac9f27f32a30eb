#include "surface/compaction.h"

#include <utility>

namespace pellicle {
inline namespace surface {

LoadedSheet compact(const Sheet& sheet, const std::vector<bool>& kept, const Records& particles, const Records& cells,
                    const SheetOptions& options) {
  MPI_Comm comm = sheet.comm();
  int ranks = 1;
  MPI_Comm_size(comm, &ranks);
  MeshRows rows = rows_of(sheet, kept, particles, cells);
  const auto own = static_cast<PetscInt>(rows.cells.size());
  PetscInt largest = 0;
  PetscInt total = 0;
  MPI_Allreduce(&own, &largest, 1, MPIU_INT, MPI_MAX, comm);
  MPI_Allreduce(&own, &total, 1, MPIU_INT, MPI_SUM, comm);
  if (static_cast<double>(largest) * ranks > options.imbalance_limit * static_cast<double>(total)) {
    rows.part.clear();
  }
  return make_sheet(comm, std::move(rows), {sheet.first_lattice_id, sheet.id_end}, options);
}

}  // namespace surface
}  // namespace pellicle
