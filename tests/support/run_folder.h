#pragma once

#include "io/output_folder.h"

namespace pellicle {

/// The folder of a run without a record.
struct RunFolder {
  explicit RunFolder(const OutputOptions& options) : output(MPI_COMM_WORLD, options, record) {}

  RunRecord record;
  OutputFolder output;
};

}  // namespace pellicle
