#include "options/petsc_options.h"

#include <petscsys.h>

#include <algorithm>
#include <iostream>
#include <set>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "base/error.h"

namespace pellicle::options {

namespace {

/// The names in PETSc's database under which each option is set. A value for one object overrides one for all, and a
/// value for one variant of a solver one for all variants.
std::vector<std::vector<std::string>> names_in_database(const std::vector<PetscOption>& options,
                                                        const ObjectTables& tables) {
  struct Given {
    int weight;
    std::size_t option;
  };
  std::unordered_map<std::string, Given> database;
  std::vector<std::vector<std::string>> names(options.size());
  for (std::size_t i = 0; i < options.size(); ++i) {
    const PetscOption& option = options[i];
    const auto give = [&](const std::string& name, int weight) {
      Given& given = database.emplace(name, Given{weight, i}).first->second;
      given = given.weight <= weight ? Given{weight, i} : given;
      names[i].push_back(name);
    };
    const std::string own = database_name(option);
    const int of_object = option.object.empty() ? 0 : 2;
    give(own, of_object + 1);
    for (const ObjectTable& object : tables.of(option.object)) {
      const std::vector<std::string> variants = object.table->variant_names(option.name);
      const std::string general = object_prefix(object.name) + option.name;
      if (general != own && object.table->is_solver_option(option.name)) {
        give(general, of_object + (variants.empty() ? 1 : 0));
      }
      for (const std::string& variant : variants) {
        give(object_prefix(object.name) + variant, of_object);
      }
    }
  }
  for (std::size_t i = 0; i < options.size(); ++i) {
    names[i].erase(std::remove_if(names[i].begin(), names[i].end(),
                                  [&](const std::string& name) { return database.at(name).option != i; }),
                   names[i].end());
  }
  return names;
}

}  // namespace

std::string database_name(const PetscOption& option) { return object_prefix(option.object) + option.name; }

void keep_last(std::vector<PetscOption>& options) {
  std::unordered_set<std::string> names;
  std::vector<PetscOption> kept;
  for (auto option = options.rbegin(); option != options.rend(); ++option) {
    if (names.insert(database_name(*option)).second) {
      kept.push_back(std::move(*option));
    }
  }
  std::reverse(kept.begin(), kept.end());
  options = std::move(kept);
}

std::vector<std::string> petsc_arguments(const std::vector<PetscOption>& options, const ObjectTables& tables) {
  std::vector<std::string> arguments;
  const auto names = names_in_database(options, tables);
  for (std::size_t i = 0; i < options.size(); ++i) {
    for (const std::string& name : names[i]) {
      arguments.push_back("-" + name);
      if (options[i].value) {
        arguments.push_back(*options[i].value);
      }
    }
  }
  return arguments;
}

std::vector<std::string> unused_petsc_options(const std::vector<PetscOption>& options, const ObjectTables& tables) {
  // Options that PETSc reads only in PetscFinalize.
  static const std::set<std::string> read_at_the_end{
      "citations",   "get_total_flops", "log",          "log_all",           "log_mpe",
      "log_view",    "log_view_memory", "malloc_debug", "malloc_dump",       "malloc_test",
      "malloc_view", "memory_view",     "mpidump",      "no_signal_handler", "nox",
      "nox_warning", "objects_dump",    "options_left", "options_view",      "x_virtual"};
  PetscInt count = 0;
  char** names = nullptr;
  char** values = nullptr;
  check(PetscOptionsLeftGet(nullptr, &count, &names, &values));
  std::set<std::string> left;
  for (PetscInt i = 0; i < count; ++i) {
    if (read_at_the_end.count(names[i]) == 0) {
      left.insert(names[i]);
    }
  }
  check(PetscOptionsLeftRestore(nullptr, &count, &names, &values));

  std::vector<std::string> lines;
  const std::string problem = ": an option of PETSc's that nothing used";
  const auto names_of = names_in_database(options, tables);
  for (std::size_t i = 0; i < options.size(); ++i) {
    const std::vector<std::string>& read_as = names_of[i];
    if (std::all_of(read_as.begin(), read_as.end(), [&](const std::string& name) { return left.count(name) > 0; })) {
      lines.push_back(options[i].origin.text() + problem);
    }
    for (const std::string& name : read_as) {
      left.erase(name);
    }
  }
  for (const std::string& name : left) {
    lines.push_back("-" + name + problem);
  }
  return lines;
}

void warn_unused(MPI_Comm comm, const std::vector<PetscOption>& options, const ObjectTables& tables) {
  if (rank_of(comm) == 0) {
    for (const std::string& line : unused_petsc_options(options, tables)) {
      std::cerr << "warning: " << line << '\n';
    }
  }
}

}  // namespace pellicle::options
