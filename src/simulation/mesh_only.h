#pragma once

#include <mpi.h>

#include "simulation/options.h"

namespace pellicle {

/// `-mesh_only`: reads or generates the mesh, checks and distributes it, tells of it whether or not a person watches,
/// and writes it as one frame: for the burning chain a sheet where all faces are quads, else a membrane. Cell fields,
/// as VTK defines them: `radius_ratio` and `aspect_ratio` (1 is best), `scaled_jacobian` (1 is best, 0 degenerate),
/// `smallest_angle` [degrees], `area` [m^2]. Collective.
/// @throws Error on a bad mesh
void mesh_only(MPI_Comm comm, const Options& options);

}  // namespace pellicle
