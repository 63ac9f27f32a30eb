#pragma once

#include <vector>

#include "surface/membrane.h"
#include "surface/shell.h"
#include "surface/split_corners.h"

namespace pellicle {
inline namespace surface {

/// Removes cells, and the corners that no kept cell has. What is left keeps its persistent ids, undeformed places,
/// texture coordinates, initial masses and groups, and stays on its ranks unless their cells then differ by more than
/// `sheet.imbalance_limit`: in that case it is spread anew, each row going from its old rank to the new one. Ranks may
/// become empty. Collective.
/// @param kept for each owned cell whether it stays; at least one of all ranks
/// @param particles what moves with the owned particles
/// @param cells what moves with the owned cells
LoadedSheet compact(const Sheet& sheet, const std::vector<bool>& kept, const Records& particles, const Records& cells,
                    const SheetOptions& options);

/// Splits corners. All else keeps its persistent ids, undeformed places, texture coordinates and groups, which copies
/// have from their corners, and stays on its ranks. Collective.
/// @param particles what moves with the owned particles, of those that are split with their shares
/// @param copies the same of the copies of this rank, in their order
/// @param cells what moves with the owned cells
LoadedSheet split(const Sheet& sheet, const SplitCorners& corners, const Records& particles, const Records& copies,
                  const Records& cells, const SheetOptions& options);
LoadedMembrane split(const Membrane& membrane, const SplitCorners& corners, const Records& particles,
                     const Records& copies, const Records& elements, const SheetOptions& options);

}  // namespace surface
}  // namespace pellicle
