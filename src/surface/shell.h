#pragma once

#include "meshing/surface_mesh.h"
#include "surface/sheet.h"
#include "surface/sheet_options.h"

namespace pellicle {

/// Spreads a quad mesh over the ranks of `comm` and builds its body-centred-square shell (burning paper, section 3.2).
///
/// Every rank receives its cells and two layers of its neighbours' cells, so that every spring that ends at a particle
/// of the rank, or shares a particle with a spring of the rank, is local with both its ends. Collective.
/// @param mesh checked quads (see fault_of_quads); only rank 0's is read
Sheet make_sheet(MPI_Comm comm, const SurfaceMesh& mesh, const SheetOptions& options);

/// Rest positions plus the initial noise, in shares of the mean cell edge (surface/perturbation.h). Collective.
/// @returns (3 x local) [m]
Eigen::Matrix3Xd perturbed_positions(const Sheet& sheet, const SheetOptions& options);

}  // namespace pellicle
