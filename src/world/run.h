#pragma once

#include <mpi.h>

#include <deque>

#include "io/run_record.h"
#include "world/options.h"

namespace pellicle {
inline namespace world {

/// Runs a world of objects from their meshes to the last frame: the whole program after its options have been read.
/// Collective.
/// @param objects of the run; what is of the run as a whole is the same in all their options; are told which of them
/// touch each other (find_together)
/// @param record what the output folder keeps of the run; of the mesh, what has been found here
/// @throws Error on bad input, before anything is written; or when a step failed at every length tried, after the last
/// good state has been written
void run(MPI_Comm comm, std::deque<ObjectOptions>& objects, RunRecord record);

}  // namespace world
}  // namespace pellicle
