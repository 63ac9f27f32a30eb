#include "options/idle_options.h"

#include <algorithm>
#include <map>
#include <set>
#include <tuple>

#include "base/error.h"

namespace pellicle::options {

namespace {

/// An option that has been given but has no effect.
struct Idle {
  const Origin* origin;
  const Condition* needs;
  bool is_solver_setting;
  bool has_acted;

  bool is_legal() const { return has_acted || (is_solver_setting && origin->is_laid_over); }
};

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

/// The options given to one object: those with an effect, by origin, and those without.
struct Given {
  std::set<std::tuple<std::string, int, std::string>> acting;
  std::vector<Idle> idle;
};

std::tuple<std::string, int, std::string> place(const Origin& origin) {
  return {origin.source, origin.line, origin.name};
}

void add_given(Given& given, const OptionTable& table) {
  for (const auto& section : table.object_sections()) {
    const Condition* needs = first_unmet(section.rules.conditions());
    for (const auto& object : section.objects) {
      if (needs == nullptr) {
        given.acting.insert(place(object.origin));
      } else {
        given.idle.push_back({&object.origin, needs, false, object.has_acted});
      }
    }
  }
  // If a whole object has no effect, it is enough to name the object.
  const auto is_of_idle_object = [&table](const Option& option) {
    const auto& sections = table.object_sections();
    return std::any_of(sections.begin(), sections.end(), [&option](const auto& section) {
      return option.key().compare(0, section.key.size() + 1, section.key + ".") == 0 &&
             first_unmet(section.rules.conditions()) != nullptr;
    });
  };
  for (const Option& option : table.options()) {
    const Condition* needs = option.idle_because();
    if (option.origin() && needs == nullptr) {
      given.acting.insert(place(*option.origin()));
    } else if (option.origin() && !option.is_blank() && !is_of_idle_object(option)) {
      given.idle.push_back({&*option.origin(), needs, option.is_solver_setting(), option.has_acted()});
    }
  }
}

std::vector<Idle> idle_options(const ObjectTables& tables, const std::vector<PetscOption>& petsc) {
  Given given;
  for (const ObjectTable& object : tables) {
    add_given(given, *object.table);
  }
  std::vector<Idle> idle;
  std::map<std::tuple<std::string, int, std::string>, std::size_t> numbers;  // of what several objects were given
  for (const Idle& one : given.idle) {
    if (given.acting.count(place(*one.origin)) > 0) {
      continue;
    }
    const auto [number, is_new] = numbers.emplace(place(*one.origin), idle.size());
    if (is_new) {
      idle.push_back(one);
    } else {
      idle[number->second].has_acted = idle[number->second].has_acted || one.has_acted;
    }
  }
  for (const PetscOption& option : petsc) {
    if (const Condition* needs = idle_because(tables, option)) {
      idle.push_back({&option.origin, needs, true, option.has_acted});
    }
  }
  std::stable_sort(idle.begin(), idle.end(), [](const Idle& a, const Idle& b) {
    return std::tie(a.origin->source, a.origin->line) < std::tie(b.origin->source, b.origin->line);
  });
  return idle;
}

/// "deck.yaml: a, b, c; more.yaml: d", the first dozen of them.
std::string names_by_source(const std::vector<Idle>& idle) {
  constexpr std::size_t most = 12;
  std::string text;
  const std::string* source = nullptr;
  for (std::size_t i = 0; i < std::min(idle.size(), most); ++i) {
    const Origin& origin = *idle[i].origin;
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
    option.has_acted = option.has_acted || idle_because(tables, option) == nullptr;
  }
}

std::string settle_idle_options(const ObjectTables& tables, std::vector<PetscOption>& petsc) {
  std::vector<Idle> idle = idle_options(tables, petsc);
  const auto first = std::find_if(idle.begin(), idle.end(), [](const Idle& given) { return !given.is_legal(); });
  if (first != idle.end()) {
    const auto count = std::count_if(first, idle.end(), [](const Idle& given) { return !given.is_legal(); });
    throw Error(first->origin->text() + ": has no effect in this run; expected with " + first->needs->words +
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
