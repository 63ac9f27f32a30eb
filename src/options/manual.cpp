#include <sstream>

#include "options/options.h"

namespace pellicle::options {

namespace {

/// The options of one module, that is with the same first word of their keys.
struct Module {
  std::string name;
  std::vector<const Option*> options;
  std::vector<const OptionTable::ObjectSection*> sections;
};

Module& module_of(std::vector<Module>& modules, const std::string& key, bool object) {
  const std::size_t dot = key.find('.');
  const std::string name = dot == std::string::npos && !object ? "general" : key.substr(0, dot);
  Module* known = first_that(modules, [&name](const Module& module) { return module.name == name; });
  return known != nullptr ? *known : modules.emplace_back(Module{name, {}, {}});
}

std::vector<Module> modules_of(const OptionTable& table) {
  std::vector<Module> modules;
  for (const Option& option : table.options()) {
    module_of(modules, option.key(), false).options.push_back(&option);
  }
  for (const auto& section : table.object_sections()) {
    module_of(modules, section.key, true).sections.push_back(&section);
  }
  return modules;
}

std::string with_unit(const Option& option) {
  const std::string& value = option.default_text();
  const bool number = !value.empty() && value != "none" && option.unit() != "1";
  return value.empty() ? "\"\"" : number ? value + " " + option.unit() : value;
}

/// Breaks a text at spaces into lines of at most 100 letters, all indented.
std::string wrapped(const std::string& text, const std::string& indent) {
  std::istringstream words(text);
  std::string lines;
  std::string line;
  for (std::string word; words >> word;) {
    if (!line.empty() && indent.size() + line.size() + 1 + word.size() > 100) {
      lines += indent + line + "\n";
      line.clear();
    }
    line += (line.empty() ? "" : " ") + word;
  }
  return line.empty() ? lines : lines + indent + line + "\n";
}

/// The conditions for an option to have an effect; empty: none.
std::string needs_text(const Option& option) {
  std::string text;
  for (const Condition& condition : option.conditions()) {
    text += (text.empty() ? "" : "; ") + condition.words;
  }
  return text;
}

std::string option_help(const Option& option) {
  const std::string range = option.range_text();
  const std::string needs = needs_text(option);
  std::string text = option.help();
  text += needs.empty() ? "" : " {" + needs + "}";
  text += option.source().empty() ? "" : " [" + option.source() + "]";
  return wrapped("-" + option.name() + " " + with_unit(option) + (range.empty() ? "" : " (" + range + ")") +
                     (option.is_of_run() ? " of the run" : ""),
                 "  ") +
         wrapped(text, "      ");
}

std::string solver_help(const SolverPrefix& solver) {
  std::string text = "PETSc solver options begin with -" + solver.prefix + ", such as -" + solver.prefix + "ksp_type";
  for (const std::string& variant : solver.variants) {
    text += (variant == solver.variants.front() ? "; one part alone with -" : ", -") + solver.prefix + variant;
  }
  return text + ".";
}

std::string cell(const std::string& text) {
  std::string escaped = text.empty() ? "" : " ";
  for (const char letter : text) {
    escaped += letter == '|' ? "\\|" : std::string(1, letter);
  }
  return escaped + " |";
}

std::string markdown_row(const Option& option) {
  return "|" + cell("`" + option.key() + "`") + cell("`-" + option.name() + "`") +
         cell(option.is_of_run() ? "run" : "object") +
         cell(option.default_text().empty() ? "\"\"" : option.default_text()) +
         cell(option.unit() == "1" ? "" : option.unit()) + cell(option.range_text()) + cell(needs_text(option)) +
         cell(option.help()) + cell(option.source()) + "\n";
}

const std::string markdown_head =
    "| YAML key | command line | of | default | unit | range | needs | meaning | source |\n"
    "|---|---|---|---|---|---|---|---|---|\n";

const std::string objects =
    "A deck of one object has its options at the top. Of several, `objects: {cloth: {mesh: {...}, sheet: {...}}, "
    "lantern: {mesh: {...}, wall: {...}}}` names each and has what is its own, of the options that are of an "
    "\"object\" (in -help: all that are not \"of the run\"), also those of its solvers. What stands at the top is for "
    "all of them, and less than what stands in one. On the command line: -heat_capacity for all, "
    "-objects_cloth_heat_capacity for one. One clock steps all: they accept a step together.";

const std::string not_done =
    "What the program does not do stands in docs/limits.md: flames, air that the sheet moves, folds that stay, and "
    "others.";

const std::string no_effect =
    "An option that is given but cannot act in the run, because what it needs is missing (in braces below; in the "
    "table under \"needs\"), is refused. Two exceptions are named once as not used: settings of solvers (project, "
    "spring, elastic, prism, volume, the solvers of heat and gas) in a deck after the first, or in PETSc's files of "
    "options, which may be for both chains; and what a later deck or the command line has made useless.";

const std::string petsc_sources =
    "Later ones win: decks, in their order; ~/.petscrc, .petscrc and petscrc; PETSC_OPTIONS; the command line, with "
    "-options_file FILE in its place.";

}  // namespace

std::string help_text(const OptionTable& table) {
  std::string text =
      "pellicle simulates thin sheets that heat, burn, shrink, wrinkle, tear and inflate.\n\n"
      "usage: mpirun -n N pellicle DECK.yaml [MORE.yaml ...] [options]\n"
      "       pellicle -help | -options_table | -version\n\n";
  text += wrapped(
      "A deck is a YAML file of options: the key heat.diffusivity is written heat: {diffusivity: 2 mm^2/s} in a deck "
      "and -heat_diffusivity \"2 mm^2/s\" on the command line. Numbers without a unit are SI. Of several decks the "
      "later wins; the command line wins over all of them. Options below show their defaults. Lists are written [1, 2, "
      "3] in a deck and 1,2,3 on the command line, rows [[0, 1], [2, 3]] and \"0,1;2,3\". Any option of PETSc's may be "
      "added on the command line or, in a deck, as petsc: {log_view: true}.",
      "");
  for (const std::string& paragraph : {objects, petsc_sources, no_effect, not_done}) {
    text += "\n" + wrapped(paragraph, "");
  }
  for (const Module& module : modules_of(table)) {
    text += "\n" + module.name + "\n";
    for (const Option* option : module.options) {
      text += option_help(*option);
    }
    for (const auto* section : module.sections) {
      text += wrapped(section->key + ": named objects; a deck creates one by its NAME. " + section->help, "  ");
      for (const Option& option : section->prototype) {
        text += option_help(option);
      }
    }
    for (const SolverPrefix& solver : table.solver_prefixes()) {
      if (solver.prefix.substr(0, solver.prefix.find('_')) == module.name) {
        text += wrapped(solver_help(solver), "  ");
      }
    }
  }
  return text;
}

std::string options_markdown(const OptionTable& table) {
  std::string text =
      "# Options\n\nWritten by `pellicle -options_table`. Defaults are in SI; a deck and the command line may give "
      "units (`0.3 mm`, `450 degC`).\n\n" +
      objects + "\n\n" + petsc_sources + "\n\n" + no_effect + "\n\n" + not_done + "\n";
  for (const Module& module : modules_of(table)) {
    text += "\n## " + module.name + "\n";
    if (!module.options.empty()) {
      text += "\n" + markdown_head;
    }
    for (const Option* option : module.options) {
      text += markdown_row(*option);
    }
    for (const auto* section : module.sections) {
      text += "\nNamed objects `" + section->key + "`: " + section->help + "\n\n" + markdown_head;
      for (const Option& option : section->prototype) {
        text += markdown_row(option);
      }
    }
    for (const SolverPrefix& solver : table.solver_prefixes()) {
      if (solver.prefix.substr(0, solver.prefix.find('_')) == module.name) {
        text += "\n" + solver_help(solver) + "\n";
      }
    }
  }
  text += "\n## What does not go together\n\n";
  for (const OptionTable::Exclusion& exclusion : table.exclusions()) {
    text +=
        "- `" + exclusion.option + "` does not go with " + exclusion.other + ": expected " + exclusion.expected + "\n";
  }
  return text;
}

}  // namespace pellicle::options
