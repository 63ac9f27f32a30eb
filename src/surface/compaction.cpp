#include "surface/compaction.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>
#include <vector>

#include "parallel/collective.h"
#include "parallel/exchange.h"

namespace pellicle::surface {

namespace {

/// @param rows of all elements of a surface
void split(MeshRows& rows, const SplitCorners& corners, const Records& copies) {
  const std::size_t vertices = rows.vertices.size();
  for (const SplitCorners::Copy& copy : corners.copies) {
    MeshRows::Point row = rows.vertices[copy.original];
    row.id = copy.id;
    row.mass *= copy.fraction;
    rows.vertices.push_back(row);
  }
  for (std::size_t vertex = 0; vertex < vertices; ++vertex) {
    rows.vertices[vertex].mass *= corners.fraction[vertex];
  }
  rows.vertex_data.append(copies);
  rows.cell_corners = corners.cell_corners;
}

}  // namespace

LoadedSheet compact(const Sheet& sheet, const std::vector<bool>& kept, const Records& particles, const Records& cells,
                    const SheetOptions& options) {
  MeshRows rows = rows_of(sheet, kept, particles, cells);
  const RankShares shares = shares_of_ranks(sheet.comm(), static_cast<double>(rows.cells.size()));
  if (shares.imbalance > options.imbalance_limit) {
    rows.part.clear();
  }
  return make_sheet(sheet.comm(), std::move(rows), {sheet.first_lattice_id, sheet.id_end}, options);
}

LoadedSheet spread(const Sheet& sheet, const std::vector<double>& load, const Records& particles, const Records& cells,
                   const SheetOptions& options) {
  std::vector<double> fraction = load;  // of each element at a particle
  for (std::size_t i = 0; i < fraction.size(); ++i) {
    fraction[i] /= std::max(sheet.cell_count[i], 1);
  }
  fraction.resize(sheet.particles.local());
  update_ghosts(sheet.particles, fraction);
  const auto of = [&fraction](PetscInt particle) { return fraction[particle]; };
  MeshRows rows = rows_of(sheet, {}, particles, cells);
  rows.part.clear();
  for (std::size_t cell = 0; cell < rows.cells.size(); ++cell) {
    const std::array<PetscInt, 4>& corners = sheet.cells[cell];
    rows.load.push_back(std::accumulate(corners.begin(), corners.end(), of(sheet.lattice[cell]),
                                        [&of](double sum, PetscInt corner) { return sum + of(corner); }));
  }
  return make_sheet(sheet.comm(), std::move(rows), {sheet.first_lattice_id, sheet.id_end}, options);
}

LoadedSheet split(const Sheet& sheet, const SplitCorners& corners, const Records& particles, const Records& copies,
                  const Records& cells, const SheetOptions& options) {
  MeshRows rows = rows_of(sheet, {}, particles, cells);
  split(rows, corners, copies);
  return make_sheet(sheet.comm(), std::move(rows), {sheet.first_lattice_id, corners.id_end}, options);
}

LoadedMembrane split(const Membrane& membrane, const SplitCorners& corners, const Records& particles,
                     const Records& copies, const Records& elements, const SheetOptions& options) {
  MeshRows rows = rows_of(membrane, particles, elements);
  split(rows, corners, copies);
  return make_membrane(membrane.comm(), std::move(rows), options);
}

}  // namespace pellicle::surface
