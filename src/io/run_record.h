#pragma once

#include <mpi.h>

#include <map>
#include <string>
#include <vector>

#include "base/deck.h"

namespace pellicle {
inline namespace io {

/// A file that an option names.
struct InputFile {
  std::string key;  ///< of the option, "objects.cloth.heat.diffusivity_texture"
  std::string path;
  std::string checksum;  ///< of its content; empty: it cannot be read
};

/// The files that options name and that a run reads again when it goes on from a checkpoint, as they are now.
/// Collective.
std::vector<InputFile> input_files(MPI_Comm comm, const ObjectTables& tables);

/// What it takes to run again what was run.
struct RunRecord {
  std::string program;                 ///< name and version
  std::string revision;                ///< of git
  std::vector<std::string> arguments;  ///< of the command line, the program's name first
  std::vector<std::string> objects;    ///< names of the run's objects; none: it has one without a name
  std::vector<Deck> decks;             ///< in the order in which they were read
  std::vector<InputFile> inputs;
  std::string options;            ///< every option with its value, as a deck
  std::vector<std::string> mesh;  ///< what it is like, what was repaired, warnings: a line each
};

/// The texts of the files that a run's folder keeps of it, by name: `run.yaml` (versions of the program and its
/// libraries, ranks, date, command line, mesh), `options.yaml` (every option with its value; itself a deck) and the
/// decks as they were, `deck_1_<name>` and so on. Not collective.
/// @param ranks of the run
std::map<std::string, std::string> record_files(const RunRecord& record, int ranks);

}  // namespace io
}  // namespace pellicle
