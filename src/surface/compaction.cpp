#include "surface/compaction.h"

#include <utility>
#include <vector>

namespace pellicle {
inline namespace surface {

namespace {

/// @param rows of all elements of a surface
void split(MeshRows& rows, const SplitCorners& corners, const Records& copies) {
  const std::size_t vertices = rows.vertices.size();
  for (const SplitCorners::Copy& copy : corners.copies) {
    MeshRows::Point row = rows.vertices[static_cast<std::size_t>(copy.original)];
    row.id = copy.id;
    row.mass *= copy.share;
    rows.vertices.push_back(row);
  }
  for (std::size_t vertex = 0; vertex < vertices; ++vertex) {
    rows.vertices[vertex].mass *= corners.share[vertex];
  }
  rows.vertex_data.append(copies);
  rows.cell_corners = corners.cell_corners;
}

}  // namespace

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

LoadedSheet split(const Sheet& sheet, const SplitCorners& corners, const Records& particles, const Records& copies,
                  const Records& cells, const SheetOptions& options) {
  MeshRows rows =
      rows_of(sheet, std::vector<bool>(static_cast<std::size_t>(sheet.elements.owned), true), particles, cells);
  split(rows, corners, copies);
  return make_sheet(sheet.comm(), std::move(rows), {sheet.first_lattice_id, corners.id_end}, options);
}

LoadedMembrane split(const Membrane& membrane, const SplitCorners& corners, const Records& particles,
                     const Records& copies, const Records& elements, const SheetOptions& options) {
  MeshRows rows = rows_of(membrane, particles, elements);
  split(rows, corners, copies);
  return make_membrane(membrane.comm(), std::move(rows), options);
}

}  // namespace surface
}  // namespace pellicle
