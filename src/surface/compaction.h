#pragma once

#include <vector>

#include "surface/membrane.h"
#include "surface/shell.h"
#include "surface/split_corners.h"

namespace pellicle::surface {

/// Removes cells, and the corners that belong to no remaining cell. The rest keeps persistent ids, undeformed places,
/// texture coordinates, initial masses and groups, and stays on its ranks unless the numbers of cells then differ by
/// more than `sheet.imbalance_limit`: in that case the sheet is distributed anew, and each row goes from its old rank
/// to the new one. Ranks may become empty. Collective.
/// @param kept whether each owned cell stays; at least one on some rank
/// @param particles what moves with the owned particles
/// @param cells what moves with the owned cells
LoadedSheet compact(const Sheet& sheet, const std::vector<bool>& kept, const Records& particles, const Records& cells,
                    const SheetOptions& options);

/// Distributes the sheet anew, so that all ranks have equal numbers of cells and equal loads. Everything keeps its
/// persistent ids, undeformed places, texture coordinates, initial masses and groups. Collective.
/// @param load of the owned particles @param particles what moves with the owned particles
/// @param cells what moves with the owned cells
LoadedSheet spread(const Sheet& sheet, const std::vector<double>& load, const Records& particles, const Records& cells,
                   const SheetOptions& options);

/// Splits corners. Everything else keeps its persistent ids, undeformed places, texture coordinates and groups (copies
/// get those of their corners), and stays on its ranks. Collective.
/// @param particles what moves with the owned particles; for those that are split, with their shares
/// @param copies data of this rank's copies of corners, in their order
/// @param cells what moves with the owned cells
LoadedSheet split(const Sheet& sheet, const SplitCorners& corners, const Records& particles, const Records& copies,
                  const Records& cells, const SheetOptions& options);
LoadedMembrane split(const Membrane& membrane, const SplitCorners& corners, const Records& particles,
                     const Records& copies, const Records& elements, const SheetOptions& options);

}  // namespace pellicle::surface
