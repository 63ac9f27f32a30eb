#pragma once

#include <Eigen/Core>
#include <vector>

#include "surface/sheet.h"
#include "surface/sheet_options.h"

namespace pellicle {

/// A sheet from which cells have been removed, and the numbers that moved with its particles and cells.
struct CompactedSheet {
  Sheet sheet;
  Eigen::MatrixXd particle_data;  ///< (rows x local), ghosts up to date
  Eigen::MatrixXd cell_data;      ///< (rows x local cells), ghosts up to date
};

/// Removes cells, and the corners that no kept cell has. What is left keeps its persistent ids, undeformed places,
/// texture coordinates and initial masses, and stays on its ranks unless their cells then differ by more than
/// `sheet.imbalance_limit`: in that case it is spread anew. Ranks may become empty. The groups of the mesh are dropped.
/// Collective.
/// @param kept for each owned cell whether it stays; at least one of all ranks
/// @param particle_data numbers of the owned particles that move with them, (rows x owned)
/// @param cell_data likewise of the owned cells, (rows x owned cells)
CompactedSheet compact(const Sheet& sheet, const std::vector<bool>& kept, const Eigen::MatrixXd& particle_data,
                       const Eigen::MatrixXd& cell_data, const SheetOptions& options);

}  // namespace pellicle
