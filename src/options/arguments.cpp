#include "options/arguments.h"

#include <dlfcn.h>
#include <petscsys.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <utility>

#include "base/error.h"
#include "options/choice.h"
#include "options/spelling.h"

namespace pellicle::options {

bool is_deck(const std::string& argument) {
  const std::string extension = std::filesystem::path(argument).extension().string();
  return extension == ".yaml" || extension == ".yml";
}

bool is_option(const std::string& argument) {
  const std::size_t letter = starts_with(argument, "--") ? 2 : 1;
  return argument.size() > letter && argument[0] == '-' && argument != "-inf" && argument != "-nan" &&
         std::isalpha(static_cast<unsigned char>(argument[letter])) != 0;
}

namespace {

struct TypedOption {
  std::string name;  ///< without the dash
  std::optional<std::string> value;
  Origin origin;
};

struct Word {
  std::string text;
  int line = 0;  ///< of its file
};

const char* const command_line = "command line";

[[noreturn]] void fail(const Origin& origin, const std::string& problem) {
  throw Error(origin.text() + ": " + problem);
}

/// Whether an option is one of the flags without a value.
bool is_flag(const std::string& name) {
  return name == "help" || name == "h" || name == "options_table" || name == "version";
}

/// The option of the program, for any object, of a name; null: none.
const Option* declared_option(const OptionTable& table, const std::string& name) {
  const auto find = [&table](const std::string& rest) {
    const Option* known = table.find_name(rest);
    return known != nullptr ? known : table.find_prototype(rest);
  };
  const Option* option = find(name);
  // Which objects there are is not known yet: "objects_" is followed by an object's name and an option's name.
  for (std::size_t end = name.find('_', name.find('_') + 1);
       option == nullptr && end != std::string::npos && starts_with(name, "objects_"); end = name.find('_', end + 1)) {
    option = find(name.substr(end + 1));
  }
  return option;
}

/// Splits the words of the command line, or of another source, into paths of decks, and options with their values.
/// @param decks gets the decks; null: the source, which is not the command line, may name none
std::vector<TypedOption> split_words(const std::vector<Word>& words, const std::string& source,
                                     const OptionTable& table, std::vector<Deck>* decks = nullptr) {
  std::vector<TypedOption> typed;
  const bool may_name_decks = decks != nullptr;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string& word = words[i].text;
    if (may_name_decks && is_deck(word)) {
      decks->push_back({word, "", "", !decks->empty()});
      continue;
    }
    const Origin origin{source, words[i].line, word, !may_name_decks};
    if (!is_option(word)) {
      fail(origin,
           std::string("neither an option nor the value of one; expected ") +
               (may_name_decks ? "a deck, DECK.yaml, or -option" : "-option, its value in quotes if it has spaces"));
    }
    TypedOption option{word.substr(word[1] == '-' ? 2 : 1), std::nullopt, origin};
    option.origin.name = "-" + option.name;
    if (!is_flag(option.name)) {
      const Option* ours = declared_option(table, option.name);
      const bool may_be_deck = may_name_decks && (ours == nullptr || ours->is_flag()) && option.name != "options_file";
      if (i + 1 < words.size() && !is_option(words[i + 1].text) && !(may_be_deck && is_deck(words[i + 1].text))) {
        option.value = words[++i].text;
      }
    }
    typed.push_back(option);
  }
  return typed;
}

/// The words of a text as PETSc's files of options have them: between spaces, or between quotes; # begins a comment.
std::vector<Word> words_in(const std::string& text) {
  std::vector<Word> words;
  int line = 1;
  for (std::size_t at = 0; at < text.size();) {
    const char letter = text[at];
    if (letter == '#') {
      at = std::min(text.find('\n', at), text.size());
    } else if (std::isspace(static_cast<unsigned char>(letter)) != 0) {
      line += letter == '\n' ? 1 : 0;
      ++at;
    } else if (letter == '"' || letter == '\'') {
      const std::size_t end = std::min(text.find(letter, at + 1), text.size());
      words.push_back({text.substr(at + 1, end - at - 1), line});
      at = end + 1;
    } else {
      const std::size_t end = std::min(text.find_first_of(" \t\r\n\f\v", at), text.size());
      words.push_back({text.substr(at, end - at), line});
      at = end;
    }
  }
  return words;
}

std::string file_text(const std::string& path, const std::string& expected) {
  std::ifstream file(path);
  std::ostringstream text;
  std::error_code none;
  const bool is_readable = file && !std::filesystem::is_directory(path, none);
  if (is_readable) {
    text << file.rdbuf();
  }
  if (!is_readable || !file) {
    throw Error(path + ": cannot be read; expected " + expected);
  }
  return text.str();
}

/// @param known names of the existing objects of a section
[[noreturn]] void refuse_unknown_object(const TypedOption& typed, const std::string& section,
                                        const std::string& known) {
  fail(typed.origin, "no such object; expected one that a deck names in " + section + ": " +
                         (known.empty() ? "there is none" : known));
}

/// Refuses `-bodies_bal_radius` if no deck has created `bal`.
void require_known_object(const OptionTable& table, const TypedOption& typed, const std::string& name) {
  for (const auto& section : table.object_sections()) {
    const bool names_object = std::any_of(section.objects.begin(), section.objects.end(), [&](const auto& object) {
      return starts_with(name, section.name + "_" + object.name + "_");
    });
    if (starts_with(name, section.name + "_") && !names_object) {
      refuse_unknown_object(typed, section.key, join(names_in(section.objects), ", "));
    }
  }
}

/// @param object for which the option is; empty: for all
/// @param name of the option, without the object
void set_option(const TypedOption& typed, const std::string& object, const std::string& name,
                const ObjectTables& tables, std::vector<PetscOption>& petsc) {
  for (const ObjectTable& one : tables.of(object)) {
    Option* option = one.table->find_name(name);
    if (option == nullptr) {
      if (const auto meant = one.table->meant_name(name)) {
        require_known_object(*one.table, typed, name);
        fail(typed.origin, "unknown option; nearest valid option: -" + object_prefix(object) + *meant);
      }
      petsc.push_back({name, typed.value, typed.origin, object});
      continue;
    }
    const bool is_blank = !typed.value || (typed.value->empty() && option->needs_value());
    if (is_blank && !option->is_flag()) {
      fail(typed.origin, "no value; expected " + option->expected());
    }
    if (!object.empty() && option->is_of_run()) {
      fail(typed.origin, "is of the run and not of one of its objects; expected -" + name);
    }
    try {
      WrittenValue value = option->from_command_line(typed.value.value_or("true"));
      option->resolve(value, "");
      option->give(value, typed.origin);
    } catch (const Error& error) {
      fail(typed.origin, error.what());
    }
  }
}

/// Applies first the options for all objects, then those for one, which override them.
void set_options(const std::vector<TypedOption>& options, const ObjectTables& tables, std::vector<PetscOption>& petsc) {
  for (const bool for_one : {false, true}) {
    for (const TypedOption& typed : options) {
      const auto [object, name] = tables.split_name(typed.name);
      if (object.empty() && starts_with(name, "objects_") && name != "objects_dump") {  // which is PETSc's
        refuse_unknown_object(typed, "objects", tables.are_named() ? join(names_in(tables), ", ") : "");
      }
      if (object.empty() != for_one) {
        set_option(typed, object, name, tables, petsc);
      }
    }
  }
  keep_last(petsc);
}

/// The options, with each `-options_file FILE` replaced by the options in that file. Not collective: for rank 0.
std::vector<TypedOption> with_files(const std::vector<TypedOption>& typed, const OptionTable& table, int depth = 0) {
  std::vector<TypedOption> all;
  for (const TypedOption& option : typed) {
    if (option.name != "options_file") {
      all.push_back(option);
      continue;
    }
    constexpr int deepest = 10;
    const std::string expected = "a file of options, -name value in each line";
    if (!option.value || depth == deepest) {
      fail(option.origin, (option.value ? "names itself; expected " : "no value; expected ") + expected);
    }
    const std::vector<Word> words = words_in(file_text(*option.value, expected));
    for (TypedOption& named : with_files(split_words(words, *option.value, table), table, depth + 1)) {
      all.push_back(std::move(named));
    }
  }
  return all;
}

/// The options that PETSc reads before the command line; later sources win. Not collective: for rank 0.
std::vector<TypedOption> options_of_surroundings(const OptionTable& table, bool skip_files) {
  std::vector<TypedOption> all;
  const auto append = [&](const std::string& source, const std::vector<Word>& words) {
    const std::vector<TypedOption> found = split_words(words, source, table);
    all.insert(all.end(), found.begin(), found.end());
  };
  std::vector<std::string> files{".petscrc", "petscrc"};
  if (const char* home = std::getenv("HOME")) {
    files.insert(files.begin(), std::string(home) + "/.petscrc");
  }
  for (const std::string& file : skip_files ? std::vector<std::string>() : files) {
    std::error_code failure;
    const std::filesystem::file_type type = std::filesystem::status(file, failure).type();
    if (type == std::filesystem::file_type::none) {
      throw Error(file + ": cannot be looked for: " + failure.message() +
                  "; expected a folder that can be read, or -skip_petscrc");
    }
    if (type == std::filesystem::file_type::regular) {
      append(file, words_in(file_text(file, "a file of options")));
    }
  }
  if (const char* text = std::getenv("PETSC_OPTIONS")) {
    std::vector<Word> words = words_in(text);
    for (Word& word : words) {
      word.line = 0;
    }
    append("PETSC_OPTIONS", words);
  }
  return all;
}

/// All options, decks aside, as rank 0 finds them, in the order in which later ones win. Collective.
std::vector<TypedOption> all_options(MPI_Comm comm, const std::vector<TypedOption>& typed, const OptionTable& table) {
  std::vector<std::string> parts;  // of each option the source, line and name, and its value after "=", or nothing
  on_root(comm, [&] {
    const bool skip_files = std::any_of(typed.begin(), typed.end(), [](const TypedOption& option) {
      return option.name == "skip_petscrc" && option.value.value_or("true") != "false";
    });
    std::vector<TypedOption> all = options_of_surroundings(table, skip_files);
    all.insert(all.end(), typed.begin(), typed.end());
    for (const TypedOption& option : with_files(all, table)) {
      parts.insert(parts.end(), {option.origin.source, std::to_string(option.origin.line), option.name,
                                 option.value ? "=" + *option.value : ""});
    }
  });
  broadcast(comm, parts);
  std::vector<TypedOption> all;
  for (auto part = parts.begin(); part != parts.end();) {
    TypedOption& option = all.emplace_back();
    option.origin.source = *part++;
    option.origin.line = std::stoi(*part++);
    option.origin.is_laid_over = option.origin.source != command_line;
    option.name = *part++;
    option.origin.name = "-" + option.name;
    if (const std::string value = *part++; !value.empty()) {
      option.value = value.substr(1);
    }
  }
  return all;
}

}  // namespace

ProgramArguments read_arguments(MPI_Comm comm, const std::vector<std::string>& words, OptionTable& table,
                                const std::function<OptionTable&(const std::string& object)>& make_table) {
  ProgramArguments arguments(table);
  std::vector<Word> typed_words;
  for (const std::string& word : words) {
    typed_words.push_back({word});
  }
  const std::vector<TypedOption> typed = split_words(typed_words, command_line, table, &arguments.decks);
  const std::vector<TypedOption> options = all_options(comm, typed, table);
  for (const TypedOption& option : options) {
    arguments.help = arguments.help || option.name == "help" || option.name == "h";
    arguments.options_table = arguments.options_table || option.name == "options_table";
    arguments.version = arguments.version || option.name == "version";
  }
  if (arguments.help || arguments.options_table || arguments.version) {
    return arguments;
  }
  on_root(comm, [&] {
    for (Deck& deck : arguments.decks) {
      deck.text = file_text(deck.path, "a deck of options in YAML");
      deck.copy_of = original_of(deck.path);
    }
  });
  for (Deck& deck : arguments.decks) {
    broadcast(comm, deck.text);
    broadcast(comm, deck.copy_of);
  }
  arguments.tables = tables_of(arguments.decks, table, make_table);
  for (const Deck& deck : arguments.decks) {
    if (!read_deck(deck, arguments.tables, arguments.petsc) && !deck.is_laid_over) {
      throw Error(deck.path + ": sets no option; expected a scene, such as mesh: {shape: rectangle, cells: [40, 40]}");
    }
    note_acting(arguments.tables, arguments.petsc);
  }
  set_options(options, arguments.tables, arguments.petsc);
  arguments.unused = settle_idle_options(arguments.tables, arguments.petsc);
  return arguments;
}

namespace {

/// Libraries start threads unasked, which makes operations on a rank's short vectors up to tens of times slower:
/// OpenBLAS on each core, CHOLMOD four, whatever OMP_NUM_THREADS says. One thread, unless the user asks for more.
void use_one_thread() {
  const char* omp_threads = std::getenv("OMP_NUM_THREADS");
  if (std::getenv("OPENBLAS_NUM_THREADS") == nullptr && omp_threads == nullptr) {
    if (void* set_threads = dlsym(RTLD_DEFAULT, "openblas_set_num_threads")) {
      reinterpret_cast<void (*)(int)>(set_threads)(1);
    }
  }
  if (omp_threads == nullptr || std::string(omp_threads) == "1") {
    if (void* set_levels = dlsym(RTLD_DEFAULT, "omp_set_max_active_levels")) {
      reinterpret_cast<void (*)(int)>(set_levels)(0);  // of parallel regions: none has more than one thread
    }
  }
}

}  // namespace

void initialize_petsc(const std::string& program, const std::vector<PetscOption>& options, const ObjectTables& tables) {
  // PETSc keeps the pointers until PetscFinalize.
  static std::vector<std::string> words;
  static std::vector<char*> pointers;
  // What else PETSc would read has been read, and checked, together with the command line.
  words = {program, "-skip_petscrc", "true", "-options_left", "false"};
  unsetenv("PETSC_OPTIONS");
  for (std::string& word : petsc_arguments(options, tables)) {
    words.push_back(std::move(word));
  }
  pointers.clear();
  for (std::string& word : words) {
    pointers.push_back(word.data());
  }
  int count = static_cast<int>(pointers.size());
  pointers.push_back(nullptr);
  char** arguments = pointers.data();
  use_one_thread();
  check(PetscInitialize(&count, &arguments, nullptr, nullptr));
  keep_petsc_messages();
}

}  // namespace pellicle::options
