#pragma once

#include <mpi.h>

#include <functional>
#include <string>
#include <vector>

#include "options/deck.h"

namespace pellicle::options {

/// Content of the command line, after the options have been set.
struct ProgramArguments {
  explicit ProgramArguments(OptionTable& table) : tables(table) {}

  ObjectTables tables;         ///< of the objects of the run
  bool help = false;           ///< -help
  bool options_table = false;  ///< -options_table
  bool version = false;        ///< -version
  std::vector<Deck> decks;     ///< in the order of the command line
  std::vector<PetscOption> petsc;
  std::string unused;  ///< line that names options given for solvers that the run does not have, or ""
};

/// Whether a word of the command line that is not the value of an option names a deck: it ends in .yaml or .yml.
bool is_deck(const std::string& argument);

/// Whether a word of the command line names an option. Negative numbers are values, as are PETSc's -inf and -nan.
bool is_option(const std::string& argument);

/// Reads the command line and the decks that it names, and sets the options: decks in their order; then what PETSc
/// reads besides the command line, in PETSc's order: the files ~/.petscrc, .petscrc and petscrc, and the environment
/// variable PETSC_OPTIONS; then the options of the command line, wherever they stand, with those of `-options_file
/// FILE` in its place. Later ones win. With one of the three flags no deck is read. Collective: rank 0 reads files and
/// environment.
/// @param words of the command line, without the program's name
/// @param table of a run of one object; gets the options unless a deck names objects
/// @param make_table makes the table of an object that a deck names, which must outlive what is returned
/// @throws Error, the same on every rank: a file that cannot be read or is wrong (read_deck); an option of the program
/// that is misspelt, lacks its value, or has a wrong one; an option without effect (settle_idle_options); a deck that
/// sets nothing and is not laid over another; an argument that is none of these.
ProgramArguments read_arguments(MPI_Comm comm, const std::vector<std::string>& words, OptionTable& table,
                                const std::function<OptionTable&(const std::string& object)>& make_table);

/// PetscInitialize with all of PETSc's own options that read_arguments has read; PETSc does not read them again. Its
/// warning about unused options is switched off, since `warn_unused` warns instead. BLAS and OpenMP get one thread
/// unless the environment sets the number. Collective on MPI_COMM_WORLD; MPI may be initialised already.
void initialize_petsc(const std::string& program, const std::vector<PetscOption>& options, const ObjectTables& tables);

}  // namespace pellicle::options
