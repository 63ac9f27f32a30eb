#pragma once

#include <mpi.h>

#include <deque>

#include "io/run_record.h"
#include "world/options.h"
#include "world/run_plan.h"

namespace pellicle::run {

/// Runs a world of objects from their meshes to the last frame: the whole program after its options have been read.
/// Collective.
/// @param objects of the run; options of the run as a whole are the same in all of them; plan_run says which of them
/// touch each other
/// @param record of the run, which is written to the output folder; receives the figures of the mesh
/// @throws Error on bad input, before anything is written; or when a step failed at every length tried, after the last
/// good state has been written
void run_objects(MPI_Comm comm, const std::deque<ObjectOptions>& objects, RunRecord record);

/// `-mesh_only`: reads or generates the mesh of each object, checks and distributes it, prints its figures whether or
/// not a person watches, and writes it as one frame: for the burning chain a sheet if all faces are quads, otherwise a
/// membrane. Cell fields, as VTK defines them: `radius_ratio` and `aspect_ratio` (1 is best), `scaled_jacobian` (1 is
/// best, 0 degenerate), `smallest_angle` [degrees], `area` [m^2]. In addition it writes the mesh with its partition,
/// `NAME.mesh.h5`, which `mesh.file` may name, and prints the plan of the run. Collective.
/// @param record of the run, which is written to the output folder; receives the figures of the mesh
/// @throws Error on a bad mesh, or where the output folder cannot be used
void mesh_only(MPI_Comm comm, const RunPlan& plan, RunRecord record);

}  // namespace pellicle::run
