#pragma once

#include "meshing/surface_mesh.h"
#include "surface/mesh_rows.h"
#include "surface/sheet.h"
#include "surface/sheet_options.h"
#include "surface/split_corners.h"

namespace pellicle::surface {

/// Layers of neighbours' cells on a rank: a green spring's neighbours end one cell beyond the next cell.
inline constexpr int shell_layers = 2;

/// Makes a sheet from the rows of a mesh. Collective.
Sheet make_sheet(MPI_Comm comm, MeshRows mesh, const SheetOptions& options);

/// Distributes a quad mesh over the ranks of `comm` and builds its body-centred-square shell (burning paper, section
/// 3.2).
///
/// Every rank receives its cells and two layers of its neighbours' cells, so that every spring that ends at a particle
/// of the rank, or shares a particle with a spring of the rank, is local with both its ends. Collective.
/// @param mesh checked quads (see fault_of_quads); only rank 0's is read
inline Sheet make_sheet(MPI_Comm comm, const SurfaceMesh& mesh, const SheetOptions& options) {
  return make_sheet(comm, rows_of(comm, mesh), options);
}

/// A sheet with the data of its particles and cells.
struct LoadedSheet {
  Sheet sheet;
  Records particles;  ///< of the local particles, ghosts up to date
  Records cells;      ///< of the local cells, ghosts up to date
};

/// Bounds of a sheet's persistent ids, as in Sheet.
struct SheetIds {
  PetscInt first_lattice_id = 0;
  PetscInt id_end = 0;
};

/// Builds a sheet from rows that are distributed over the ranks in any way. Its numbers depend only on the cells, their
/// ids and their ranks. Collective.
/// @param rows of a sheet: cells have the ids of their lattice points, whose places and masses follow from the corners'
/// places and the options
LoadedSheet make_sheet(MPI_Comm comm, MeshRows rows, const SheetIds& ids, const SheetOptions& options);

/// The sheet as rows: cells and vertices on the ranks that own them, corners without a kept cell included. Collective.
/// @param kept whether each owned cell is included; empty: all
/// @param particles data of the owned particles
/// @param cells data of the owned cells
MeshRows rows_of(const Sheet& sheet, const std::vector<bool>& kept, const Records& particles, const Records& cells);

/// The mesh from which a sheet was made, as rows. Collective.
MeshRows rows_of_mesh(const Sheet& sheet);

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

/// Rest positions plus the initial noise, whose unit is the mean cell edge (surface/distribution.h). Collective.
/// @returns (3 x local) [m]
Eigen::Matrix3Xd perturbed_positions(const Sheet& sheet, const SheetOptions& options);

}  // namespace pellicle::surface
