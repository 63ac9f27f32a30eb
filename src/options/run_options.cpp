#include "options/run_options.h"

#include <petscsys.h>

#include <algorithm>
#include <iostream>
#include <set>
#include <tuple>
#include <unordered_map>
#include <unordered_set>

#include "base/error.h"
#include "base/sorting.h"
#include "options/spelling.h"

namespace pellicle::options {

std::vector<ObjectTable> ObjectTables::of(const std::string& object) const {
  std::vector<ObjectTable> result;
  std::copy_if(begin(), end(), std::back_inserter(result),
               [&object](const ObjectTable& one) { return object.empty() || one.name == object; });
  return result;
}

std::pair<std::string, std::string> ObjectTables::split_name(const std::string& name) const {
  std::pair<std::string, std::string> found{"", name};
  for (const ObjectTable& one : tables_) {
    const std::string start = object_prefix(one.name);
    if (one.name.size() > found.first.size() && starts_with(name, start)) {
      found = {one.name, name.substr(start.size())};
    }
  }
  return found;
}

std::string object_prefix(const std::string& object) { return object.empty() ? "" : "objects_" + object + "_"; }

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

namespace {

/// The condition that an option lacks to have an effect; null: it has an effect in one of its objects.
const Condition* idle_because(const ObjectTables& tables, const PetscOption& option) {
  const Condition* needs = nullptr;
  for (const ObjectTable& object : tables.of(option.object)) {
    const SolverPrefix* solver = object.table->solver_of(option.name);
    needs = solver == nullptr ? nullptr : first_unmet(solver->conditions);
    if (needs == nullptr) {
      return nullptr;
    }
  }
  return needs;
}

/// An option that has been given, or a named object.
struct GivenOption {
  Origin origin;           ///< if it was given to several objects, it has acted if it has in one of them
  const Condition* needs;  ///< what it lacks to have an effect; null: it has one, in one of its objects
  bool is_solver_setting = false;

  bool is_legal() const { return origin.has_acted || (is_solver_setting && origin.is_laid_over); }
};

/// Adds what was given to one object; what several were given in one place is one.
void add(std::vector<GivenOption>& all, const GivenOption& given) {
  const auto place = [](const GivenOption& one) {
    return std::tie(one.origin.line, one.origin.name, one.origin.source);
  };
  GivenOption* same = first_that(all, [&](const GivenOption& other) { return place(other) == place(given); });
  if (same == nullptr) {
    all.push_back(given);
    return;
  }
  same->origin.has_acted = same->origin.has_acted || given.origin.has_acted;
  same->needs = given.needs == nullptr ? nullptr : same->needs;
}

/// Adds what was given to one object.
void add_given(std::vector<GivenOption>& all, const OptionTable& table) {
  for (const auto& section : table.object_sections()) {
    for (const auto& object : section.objects) {
      add(all, {object.origin, first_unmet(section.rules.conditions())});
    }
  }
  // If a whole object has no effect, it is enough to name the object.
  const auto is_of_idle_object = [&table](const Option& option) {
    const auto& sections = table.object_sections();
    return std::any_of(sections.begin(), sections.end(), [&option](const auto& section) {
      return starts_with(option.key(), section.key + ".") && first_unmet(section.rules.conditions()) != nullptr;
    });
  };
  for (const Option& option : table.options()) {
    const Condition* needs = option.idle_because();
    if (option.origin() && (needs == nullptr || (!option.is_blank() && !is_of_idle_object(option)))) {
      add(all, {*option.origin(), needs, option.is_solver_setting()});
    }
  }
}

/// The options and objects that have been given but have no effect, ordered by source and line.
std::vector<GivenOption> idle_options(const ObjectTables& tables, const std::vector<PetscOption>& petsc) {
  std::vector<GivenOption> given;
  for (const ObjectTable& object : tables) {
    add_given(given, *object.table);
  }
  for (const PetscOption& option : petsc) {
    given.push_back({option.origin, idle_because(tables, option), true});
  }
  given.erase(std::remove_if(given.begin(), given.end(), [](const GivenOption& one) { return one.needs == nullptr; }),
              given.end());
  std::stable_sort(given.begin(), given.end(), [](const GivenOption& a, const GivenOption& b) {
    return std::tie(a.origin.source, a.origin.line) < std::tie(b.origin.source, b.origin.line);
  });
  return given;
}

/// "deck.yaml: a, b, c; more.yaml: d", the first dozen of them.
std::string names_by_source(const std::vector<GivenOption>& idle) {
  constexpr std::size_t most = 12;
  std::string text;
  const std::string* source = nullptr;
  for (std::size_t i = 0; i < std::min(idle.size(), most); ++i) {
    const Origin& origin = idle[i].origin;
    const bool same = source != nullptr && *source == origin.source;
    text += (same ? ", " : (i > 0 ? "; " : "") + origin.source + ": ") + origin.name;
    source = &origin.source;
  }
  return text + (idle.size() > most ? ", ... (" + std::to_string(idle.size()) + " in all)" : "");
}

}  // namespace

void note_acting(const ObjectTables& tables, std::vector<PetscOption>& petsc) {
  for (const ObjectTable& object : tables) {
    object.table->note_acting();
  }
  for (PetscOption& option : petsc) {
    option.origin.has_acted = option.origin.has_acted || idle_because(tables, option) == nullptr;
  }
}

std::string settle_idle_options(const ObjectTables& tables, std::vector<PetscOption>& petsc) {
  const std::vector<GivenOption> idle = idle_options(tables, petsc);
  const auto first = std::find_if(idle.begin(), idle.end(), [](const GivenOption& given) { return !given.is_legal(); });
  if (first != idle.end()) {
    const auto count = std::count_if(first, idle.end(), [](const GivenOption& given) { return !given.is_legal(); });
    throw Error(first->origin.text() + ": has no effect in this run; expected with " + first->needs->words +
                (first->is_solver_setting ? ", or in a deck laid over the scene's" : "") +
                (count > 1 ? " (and " + std::to_string(count - 1) + " more without effect)" : ""));
  }
  const std::string names = names_by_source(idle);
  petsc.erase(std::remove_if(petsc.begin(), petsc.end(),
                             [&](const PetscOption& option) { return idle_because(tables, option) != nullptr; }),
              petsc.end());
  return names.empty() ? "" : "not used in this run: " + names;
}

}  // namespace pellicle::options
