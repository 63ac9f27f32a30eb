#include <fcntl.h>
#include <mpi.h>
#include <petscsys.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <iostream>
#include <thread>

#include "base/error.h"
#include "base/stop_signal.h"
#include "large_pages.h"
#include "options/arguments.h"
#include "revision_text.h"  // written by the build
#include "run/run.h"

using namespace pellicle;

namespace {

/// Adds a run's own options as the deck, and its folder, to a command line that names a run to continue and no deck:
/// `pellicle -restart output/hot_ball`. @returns whether it does
bool add_kept_options(std::vector<std::string>& words) {
  namespace fs = std::filesystem;
  if (std::any_of(words.begin(), words.end(), is_deck)) {
    return false;
  }
  fs::path run;
  for (std::size_t i = 0; i + 1 < words.size(); ++i) {
    if ((words[i] == "-restart" || words[i] == "--restart") && !is_option(words[i + 1])) {
      run = words[i + 1];
    }
  }
  if (run.empty()) {
    return false;
  }
  std::error_code none;
  const bool is_file = fs::is_regular_file(run, none) || (run.extension() == ".h5" && !fs::is_directory(run, none));
  fs::path folder = is_file || !run.has_filename() ? run.parent_path() : run;
  folder = folder.empty() ? "." : folder;
  words.insert(words.begin(), {(folder / "options.yaml").string(), "-output_directory", folder.string()});
  return true;
}

/// Reads the options and runs accordingly. @returns the exit code. Collective.
int run_program(int argc, char** argv, bool is_root) {
  std::deque<ObjectOptions> objects;
  OptionTable& table = objects.emplace_back("").table;
  std::vector<std::string> words(argv + 1, argv + argc);
  const bool has_kept_options = add_kept_options(words);
  const ProgramArguments arguments =
      read_arguments(MPI_COMM_WORLD, words, table,
                     [&objects](const std::string& name) -> OptionTable& { return objects.emplace_back(name).table; });
  const std::string program = "pellicle " PELLICLE_VERSION;
  if (arguments.help || arguments.options_table || arguments.version) {
    if (is_root) {
      std::cout << (arguments.help            ? help_text(table)
                    : arguments.options_table ? options_markdown(table)
                                              : program + " (" PELLICLE_GIT_REVISION ")\n");
    }
    return 0;
  }
  if (arguments.tables.are_named()) {
    objects.pop_front();  // of the object without a name, which there is not
  }
  RunRecord record;
  for (ObjectOptions& object : objects) {
    OutputOptions& output = object.options.output;
    output.name_after(arguments.decks.empty() ? "pellicle.yaml" : arguments.decks.front().source());
    output.validate();
    if (!object.name.empty()) {
      record.objects.push_back(object.name);
    }
  }
  record.program = program;
  record.revision = PELLICLE_GIT_REVISION;  // with "-dirty" when tracked files had been changed
  record.arguments.assign(argv, argv + argc);
  record.decks = has_kept_options ? std::vector<Deck>() : arguments.decks;
  record.options = written_deck(arguments.tables, arguments.petsc);
  record.inputs = input_files(MPI_COMM_WORLD, arguments.tables);
  if (is_root && !arguments.unused.empty()) {
    std::cout << arguments.unused << '\n';
  }
  initialize_petsc(argv[0], arguments.petsc, arguments.tables);
  catch_stop_signals(is_root ? 0 : 1);
  run_objects(PETSC_COMM_WORLD, objects, record);
  if (!objects.front().options.mesh_only) {  // which solves nothing
    warn_unused(PETSC_COMM_WORLD, arguments.petsc, arguments.tables);
  }
  return 0;
}

/// Sets OpenMPI's options for a run without a launcher: no daemon, which takes longer to start than the program; no
/// folder for files that ranks share, since without the daemon all such runs would use the same folder and remove it
/// from each other; and no shared position in files, which OpenMPI would keep in that folder.
void stand_alone() {
  setenv("OMPI_MCA_ess_singleton_isolated", "1", 0);
  setenv("OMPI_MCA_orte_create_session_dirs", "0", 0);
  setenv("OMPI_MCA_sharedfp", "individual", 0);
}

/// Opens standard input, output and error if they are closed: otherwise a file of the run would get their number, and
/// printed text would go into it.
void open_standard_streams() {
  int file = open("/dev/null", O_RDWR);
  while (file >= 0 && file <= STDERR_FILENO) {
    file = open("/dev/null", O_RDWR);
  }
  if (file > STDERR_FILENO) {
    close(file);
  }
}

}  // namespace

int main(int argc, char** argv) {
  // The rank as mpirun gives it, until MPI is initialised.
  const char* launched = std::getenv("OMPI_COMM_WORLD_RANK");
  int rank = launched != nullptr ? std::atoi(launched) : 0;
  int status = 1;
  use_large_pages();
  open_standard_streams();
  catch_stop_signals(rank);
  if (std::getenv("PMIX_RANK") == nullptr) {
    stand_alone();
  }
  MPI_Init(&argc, &argv);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  catch_stop_signals(rank);
  try {
    status = run_program(argc, argv, rank == 0);
  } catch (const Error& error) {  // The same on every rank.
    if (const auto* interrupted = dynamic_cast<const Interrupted*>(&error)) {
      status = 128 + interrupted->signal();
    }
    if (rank == 0) {
      std::cout << std::flush;
      std::cerr << "pellicle: " << error.what() << std::endl;
    }
  } catch (const std::exception& failure) {  // Perhaps on this rank alone: the others must not wait for it.
    if (rank > 0) {                          // If all ranks failed, the first one's message is enough.
      std::this_thread::sleep_for(std::chrono::seconds(1));
    }
    std::cout << std::flush;
    const int ranks = ranks_of(MPI_COMM_WORLD);
    std::cerr << ("pellicle: " + (ranks > 1 ? "rank " + std::to_string(rank) + ": " : "") + words_of(failure) + "\n")
              << std::flush;
    if (ranks > 1) {
      MPI_Abort(MPI_COMM_WORLD, status);
    }
  }
  release_stop_signals();
  PetscBool initialized = PETSC_FALSE;
  PetscInitialized(&initialized);
  if (initialized == PETSC_TRUE) {
    PetscFinalize();
  }
  MPI_Finalize();
  return status;
}
