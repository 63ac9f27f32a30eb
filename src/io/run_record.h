#pragma once

#include <mpi.h>

#include <string>
#include <vector>

namespace pellicle {

/// What it takes to run again what was run.
struct RunRecord {
  std::string program;                 ///< name and version
  std::string revision;                ///< of git
  std::vector<std::string> arguments;  ///< of the command line, the program's name first
  std::vector<std::string> decks;      ///< paths, in the order in which they were read
  std::string options;                 ///< every option with its value, as a deck
};

/// Writes into the folder of a run: `run.yaml` (versions of the program and its libraries, ranks, date, command line),
/// `options.yaml` (every option with its value; itself a deck) and the decks as they were, `deck_1_<name>` and so on.
/// The folder is made if need be; a record of an older run is replaced. Collective. @throws Error, on all ranks.
void write_run_record(MPI_Comm comm, const std::string& directory, const RunRecord& record);

}  // namespace pellicle
