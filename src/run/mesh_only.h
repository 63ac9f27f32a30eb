#pragma once

#include <mpi.h>


#include "io/run_record.h"
#include "world/run_plan.h"

namespace pellicle {
inline namespace run {

/// `-mesh_only`: reads or generates the mesh of each object, checks and distributes it, prints its figures whether or
/// not a person watches, and writes it as one frame: for the burning chain a sheet if all faces are quads, otherwise a
/// membrane. Cell fields, as VTK defines them: `radius_ratio` and `aspect_ratio` (1 is best), `scaled_jacobian` (1 is
/// best, 0 degenerate), `smallest_angle` [degrees], `area` [m^2]. In addition it writes the mesh with its partition,
/// `NAME.mesh.h5`, which `mesh.file` may name, and prints the plan of the run. Collective.
/// @param record of the run, which is written to the output folder; receives the figures of the mesh
/// @throws Error on a bad mesh, or where the output folder cannot be used
void mesh_only(MPI_Comm comm, const RunPlan& plan, RunRecord record);

}  // namespace run
}  // namespace pellicle
