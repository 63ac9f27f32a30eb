#include <mpi.h>
#include <petscsys.h>

#include <algorithm>
#include <chrono>
#include <iostream>
#include <thread>

#include "base/arguments.h"
#include "base/error.h"
#include "base/manual.h"
#include "base/revision.h"
#include "simulation/run.h"

using namespace pellicle;

namespace {

/// PETSc's options without what decks, which may be made for both chains, say of solvers that this run does not have.
std::vector<PetscOption> of_solvers_in_use(std::vector<PetscOption> petsc, const Options& options) {
  const std::vector<std::string> idle = idle_solver_prefixes(options);
  petsc.erase(std::remove_if(petsc.begin(), petsc.end(),
                             [&](const PetscOption& option) {
                               const bool from_deck = option.written.rfind('-', 0) != 0;
                               return from_deck &&
                                      std::any_of(idle.begin(), idle.end(), [&](const std::string& prefix) {
                                        return option.name.rfind(prefix, 0) == 0;
                                      });
                             }),
              petsc.end());
  return petsc;
}

/// Reads the options and runs what they ask for. @returns the exit code. Collective.
int run_program(int argc, char** argv, bool is_root) {
  Options options;
  OptionTable table;
  describe(table, options);
  const ProgramArguments arguments = read_arguments(MPI_COMM_WORLD, argc, argv, table);
  const std::string program = std::string("pellicle ") + version();
  if (arguments.help || arguments.options_table || arguments.version) {
    if (is_root) {
      std::cout << (arguments.help            ? help_text(table)
                    : arguments.options_table ? options_markdown(table)
                                              : program + " (" + git_revision() + ")\n");
    }
    return 0;
  }
  options.output.name_after(arguments.decks.empty() ? "pellicle.yaml" : arguments.decks.front().path);
  options.output.validate();

  RunRecord record;
  record.program = program;
  record.revision = git_revision();
  record.arguments.assign(argv, argv + argc);
  for (const Deck& deck : arguments.decks) {
    record.decks.push_back(deck.path);
  }
  record.options = written_deck(table, arguments.petsc);
  const std::vector<PetscOption> petsc = of_solvers_in_use(arguments.petsc, options);
  initialize_petsc(argv[0], petsc, table);
  run(PETSC_COMM_WORLD, options, record);
  warn_unused(PETSC_COMM_WORLD, petsc, table);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  MPI_Init(&argc, &argv);
  int rank = 0;
  int status = 1;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  try {
    status = run_program(argc, argv, rank == 0);
  } catch (const Error& error) {  // The same on every rank.
    if (rank == 0) {
      std::cout << std::flush;
      std::cerr << "pellicle: " << error.what() << std::endl;
    }
  } catch (const std::exception& failure) {  // Perhaps on this rank alone: the others must not wait for it.
    if (rank > 0) {                          // If all ranks failed, the first one's message is enough.
      std::this_thread::sleep_for(std::chrono::seconds(1));
    }
    std::cerr << ("pellicle: rank " + std::to_string(rank) + ": " + failure.what() + "\n") << std::flush;
    MPI_Abort(MPI_COMM_WORLD, 2);
  }
  PetscBool initialized = PETSC_FALSE;
  PetscInitialized(&initialized);
  if (initialized == PETSC_TRUE) {
    PetscFinalize();
  }
  MPI_Finalize();
  return status;
}
