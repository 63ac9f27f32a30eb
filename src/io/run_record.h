#pragma once

#include <mpi.h>

#include <map>
#include <string>
#include <vector>

#include "options/deck.h"

namespace pellicle::io {

/// A file that an option names.
struct InputFile {
  std::string key;  ///< of the option, "objects.cloth.heat.diffusivity_texture"
  std::string path;
  std::string checksum;  ///< of the content; empty: the file cannot be read
};

/// The present files that options name and that a run reads again when it continues from a checkpoint. Collective.
std::vector<InputFile> input_files(MPI_Comm comm, const ObjectTables& tables);

/// Record of a run, sufficient to repeat it.
struct RunRecord {
  std::string program;                 ///< name and version
  std::string revision;                ///< of git
  std::vector<std::string> arguments;  ///< of the command line, the program's name first
  std::vector<std::string> objects;    ///< names of the run's objects; empty: one object without a name
  std::vector<Deck> decks;             ///< in the order in which they were read
  std::vector<InputFile> inputs;
  std::string options;            ///< every option with its value, as a deck
  std::vector<std::string> mesh;  ///< properties, repairs and warnings of the mesh, a line each
};

/// The texts of the files of a run's record, by name: `run.yaml` (versions of the program and its libraries, ranks,
/// date, command line, mesh), `options.yaml` (every option with its value; itself a deck) and the decks,
/// `deck_1_<name>` and so on. Not collective.
/// @param ranks of the run
std::map<std::string, std::string> record_files(const RunRecord& record, int ranks);

}  // namespace pellicle::io
