#pragma once

#include <mpi.h>

#include "io/run_record.h"
#include "world/options.h"

namespace pellicle {

/// Runs the burning chain from the mesh to the last frame: the whole program after its options have been read.
/// Collective.
/// @param record what the output folder keeps of the run; of the mesh, what has been found here
/// @param table of the options, which says what may change where a run goes on
/// @throws Error on bad input, before anything is written; or when a step failed at every length tried, after the last
/// good state has been written
void run(MPI_Comm comm, const Options& options, RunRecord record, const OptionTable& table);

}  // namespace pellicle
