#include "base/arguments.h"

#include <dlfcn.h>
#include <petscsys.h>

#include <cctype>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>

#include "base/error.h"
#include "base/spelling.h"

namespace pellicle {

namespace {

struct TypedOption {
  std::string name;  ///< without the dash
  std::optional<std::string> value;
};

/// Negative numbers are values, as are PETSc's -inf and -nan.
bool is_option(const std::string& argument) {
  const std::size_t letter = argument.compare(0, 2, "--") == 0 ? 2 : 1;
  return argument.size() > letter && argument[0] == '-' && argument != "-inf" && argument != "-nan" &&
         std::isalpha(static_cast<unsigned char>(argument[letter])) != 0;
}

bool is_deck(const std::string& argument) {
  const std::string extension = std::filesystem::path(argument).extension().string();
  return extension == ".yaml" || extension == ".yml";
}

[[noreturn]] void fail(const std::string& option, const std::string& problem) {
  throw Error("command line: " + option + ": " + problem);
}

/// Splits the command line into flags, paths of decks and options with their values.
std::vector<TypedOption> split_arguments(int argc, const char* const* argv, const OptionTable& table,
                                         ProgramArguments& arguments) {
  std::vector<TypedOption> typed;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (is_deck(argument)) {
      arguments.decks.push_back({argument, ""});
      continue;
    }
    if (!is_option(argument)) {
      fail(argument, "neither an option nor the value of one; expected a deck, DECK.yaml, or -option");
    }
    TypedOption option{argument.substr(argument[1] == '-' ? 2 : 1), std::nullopt};
    if (option.name == "help" || option.name == "h") {
      arguments.help = true;
    } else if (option.name == "options_table") {
      arguments.options_table = true;
    } else if (option.name == "version") {
      arguments.version = true;
    } else {
      const Option* known = table.find_name(option.name);
      const Option* ours = known != nullptr ? known : table.find_prototype(option.name);
      const bool may_be_deck = ours == nullptr || ours->is_flag();
      if (i + 1 < argc && !is_option(argv[i + 1]) && !(may_be_deck && is_deck(argv[i + 1]))) {
        option.value = argv[++i];
      }
      typed.push_back(option);
    }
  }
  return typed;
}

std::string file_text(const std::string& path) {
  std::ifstream file(path);
  std::ostringstream text;
  if (file && !std::filesystem::is_directory(path)) {
    text << file.rdbuf();
  }
  if (!file || std::filesystem::is_directory(path)) {
    throw Error(path + ": cannot be read; expected a deck of options in YAML");
  }
  return text.str();
}

void broadcast(MPI_Comm comm, std::string& text) {
  int length = static_cast<int>(text.size());
  MPI_Bcast(&length, 1, MPI_INT, 0, comm);
  text.resize(static_cast<std::size_t>(length));
  MPI_Bcast(text.data(), length, MPI_CHAR, 0, comm);
}

/// For `-bodies_bal_radius` where no deck has created `bal`: names the objects there are.
void refuse_unknown_object(const OptionTable& table, const TypedOption& typed) {
  for (const auto& section : table.object_sections()) {
    if (typed.name.compare(0, section.name.size() + 1, section.name + "_") != 0) {
      continue;
    }
    std::string known;
    bool names_object = false;
    for (const std::string& object : section.objects) {
      known += (known.empty() ? "" : ", ") + object;
      const std::string start = section.name + "_" + object + "_";
      names_object = names_object || typed.name.compare(0, start.size(), start) == 0;
    }
    if (!names_object) {
      fail("-" + typed.name, "no such object; expected one that a deck names in " + section.key + ": " +
                                 (known.empty() ? "there is none" : known));
    }
  }
}

void set_option(const TypedOption& typed, OptionTable& table, std::vector<PetscOption>& petsc) {
  const std::string written = "-" + typed.name;
  if (Option* option = table.find_name(typed.name)) {
    if (!typed.value && !option->is_flag()) {
      fail(written, "no value; expected " + option->expected());
    }
    try {
      WrittenValue value = option->from_command_line(typed.value.value_or("true"));
      option->resolve(value, "");
      option->assign(value);
    } catch (const Error& error) {
      fail(written, error.what());
    }
    return;
  }
  if (const auto meant = table.meant_name(typed.name)) {
    refuse_unknown_object(table, typed);
    fail(written, "unknown option; nearest valid option: -" + *meant);
  }
  set_petsc_option(petsc, {typed.name, typed.value, "command line: " + written});
}

}  // namespace

ProgramArguments read_arguments(MPI_Comm comm, int argc, const char* const* argv, OptionTable& table) {
  ProgramArguments arguments;
  const std::vector<TypedOption> typed = split_arguments(argc, argv, table, arguments);
  if (arguments.help || arguments.options_table || arguments.version) {
    return arguments;
  }
  on_root(comm, [&] {
    for (Deck& deck : arguments.decks) {
      deck.text = file_text(deck.path);
    }
  });
  for (Deck& deck : arguments.decks) {
    broadcast(comm, deck.text);
    read_deck(deck, table, arguments.petsc);
  }
  for (const TypedOption& option : typed) {
    set_option(option, table, arguments.petsc);
  }
  return arguments;
}

namespace {

/// OpenBLAS, where it is the BLAS that PETSc uses, starts a thread a core, which makes the short vectors of a rank tens
/// of times slower: one thread, unless the user asks for more.
void use_one_blas_thread() {
  if (std::getenv("OPENBLAS_NUM_THREADS") == nullptr && std::getenv("OMP_NUM_THREADS") == nullptr) {
    if (void* set_threads = dlsym(RTLD_DEFAULT, "openblas_set_num_threads")) {
      reinterpret_cast<void (*)(int)>(set_threads)(1);
    }
  }
}

}  // namespace

void initialize_petsc(const std::string& program, const std::vector<PetscOption>& options, const OptionTable& table) {
  // PETSc keeps the pointers until PetscFinalize.
  static std::vector<std::string> words;
  static std::vector<char*> pointers;
  words = {program, "-options_left", "false"};
  for (std::string& word : petsc_arguments(options, table)) {
    words.push_back(std::move(word));
  }
  pointers.clear();
  for (std::string& word : words) {
    pointers.push_back(word.data());
  }
  int count = static_cast<int>(pointers.size());
  pointers.push_back(nullptr);
  char** arguments = pointers.data();
  use_one_blas_thread();
  check(PetscInitialize(&count, &arguments, nullptr, nullptr));
  keep_petsc_messages();
  std::signal(SIGPIPE, SIG_DFL);  // `pellicle ... | head` ends quietly, without PETSc's trace.
}

}  // namespace pellicle
