#pragma once

#include <mpi.h>

#include <deque>

#include "io/run_record.h"
#include "world/options.h"

namespace pellicle {
inline namespace run {

/// Runs a world of objects from their meshes to the last frame: the whole program after its options have been read.
/// Collective.
/// @param objects of the run; options of the run as a whole are the same in all of them; find_together sets which of
/// them touch each other
/// @param record of the run, which is written to the output folder; receives the figures of the mesh
/// @throws Error on bad input, before anything is written; or when a step failed at every length tried, after the last
/// good state has been written
void run_objects(MPI_Comm comm, const std::deque<ObjectOptions>& objects, RunRecord record);

}  // namespace run
}  // namespace pellicle
