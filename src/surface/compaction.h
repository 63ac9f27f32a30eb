#pragma once

#include <vector>

#include "surface/shell.h"

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

}  // namespace surface
}  // namespace pellicle
