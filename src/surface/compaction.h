#pragma once

#include <vector>

#include "parallel/records.h"
#include "surface/sheet.h"
#include "surface/sheet_options.h"

namespace pellicle {

/// A sheet from which cells have been removed, and what moved with its particles and cells.
struct CompactedSheet {
  Sheet sheet;
  Records particles;  ///< of the local particles, ghosts up to date
  Records cells;      ///< of the local cells, ghosts up to date
};

/// Removes cells, and the corners that no kept cell has. What is left keeps its persistent ids, undeformed places,
/// texture coordinates and initial masses, and stays on its ranks unless their cells then differ by more than
/// `sheet.imbalance_limit`: in that case it is spread anew. Ranks may become empty. The groups of the mesh are dropped.
/// Collective.
/// @param kept for each owned cell whether it stays; at least one of all ranks
/// @param particles what moves with the owned particles
/// @param cells what moves with the owned cells
CompactedSheet compact(const Sheet& sheet, const std::vector<bool>& kept, const Records& particles,
                       const Records& cells, const SheetOptions& options);

}  // namespace pellicle
