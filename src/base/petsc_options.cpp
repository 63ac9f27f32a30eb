#include "base/petsc_options.h"

#include <petscsys.h>

#include <algorithm>
#include <iostream>
#include <set>

#include "base/error.h"

namespace pellicle {

namespace {

const PetscOption* find(const std::vector<PetscOption>& options, const std::string& name) {
  const auto found =
      std::find_if(options.begin(), options.end(), [&](const PetscOption& option) { return option.name == name; });
  return found == options.end() ? nullptr : &*found;
}

/// The variants' names that `option` is handed to.
std::vector<std::string> handed_names(const PetscOption& option, const std::vector<PetscOption>& options,
                                      const OptionTable& table) {
  std::vector<std::string> names = table.variant_names(option.name);
  names.erase(std::remove_if(names.begin(), names.end(),
                             [&](const std::string& name) { return find(options, name) != nullptr; }),
              names.end());
  return names;
}

}  // namespace

void set_petsc_option(std::vector<PetscOption>& options, PetscOption option) {
  options.erase(std::remove_if(options.begin(), options.end(),
                               [&](const PetscOption& other) { return other.name == option.name; }),
                options.end());
  options.push_back(std::move(option));
}

std::vector<std::string> petsc_arguments(const std::vector<PetscOption>& options, const OptionTable& table) {
  std::vector<std::string> arguments;
  const auto append = [&](const std::string& name, const std::optional<std::string>& value) {
    arguments.push_back("-" + name);
    if (value) {
      arguments.push_back(*value);
    }
  };
  for (const PetscOption& option : options) {
    append(option.name, option.value);
    for (const std::string& name : handed_names(option, options, table)) {
      append(name, option.value);
    }
  }
  return arguments;
}

std::vector<std::string> unused_petsc_options(const std::vector<PetscOption>& options, const OptionTable& table) {
  // What PETSc reads in PetscFinalize only.
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
  for (const PetscOption& option : options) {
    std::vector<std::string> read_as = handed_names(option, options, table);
    read_as.push_back(option.name);
    if (std::all_of(read_as.begin(), read_as.end(), [&](const std::string& name) { return left.count(name) > 0; })) {
      lines.push_back(option.origin.text() + problem);
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

void warn_unused(MPI_Comm comm, const std::vector<PetscOption>& options, const OptionTable& table) {
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  if (rank == 0) {
    for (const std::string& line : unused_petsc_options(options, table)) {
      std::cerr << "warning: " << line << '\n';
    }
  }
}

}  // namespace pellicle
