#include "base/deck.h"

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <map>

#include "base/error.h"
#include "base/spelling.h"

namespace pellicle {

namespace {

/// Walks the maps of one deck.
class DeckReader {
 public:
  DeckReader(const std::string& path, OptionTable& table, std::vector<PetscOption>& petsc)
      : path_(path), table_(table), petsc_(petsc) {}

  void read_map(const YAML::Node& map, const std::string& parent) {
    std::map<std::string, int> first_lines;
    for (const auto& entry : map) {
      line_ = entry.first.Mark().line + 1;
      if (!entry.first.IsScalar()) {
        fail(parent.empty() ? "deck" : parent, "a key that is no word; expected the name of an option");
      }
      const std::string word = entry.first.Scalar();
      const std::string key = parent.empty() ? word : parent + "." + word;
      if (word.find('.') != std::string::npos) {
        fail(key, "a key with dots; expected nested maps such as heat: {diffusivity: ...}");
      }
      const auto [first, is_new] = first_lines.emplace(word, line_);
      if (!is_new) {
        fail(key, "duplicate key, first given in line " + std::to_string(first->second) + "; expected once");
      }
      read_entry(key, entry.second);
    }
  }

 private:
  void read_entry(const std::string& key, const YAML::Node& node) {
    const bool in_petsc = key.compare(0, 6, "petsc.") == 0;
    if (Option* option = table_.find_key(key)) {
      try {
        WrittenValue written = written_value(*option, node);
        option->resolve(written, std::filesystem::path(path_).parent_path().string());
        option->assign(written);
      } catch (const Error& error) {
        fail(key, error.what());
      }
    } else if (table_.find_section(key) != nullptr) {
      read_objects(key, node);
    } else if (!node.IsMap() && (in_petsc || table_.is_solver_option(command_line_name(key)))) {
      read_petsc_option(key, command_line_name(in_petsc ? key.substr(6) : key), node);
    } else if (key == "petsc" || in_petsc || table_.is_group(key)) {
      if (!node.IsMap() && !node.IsNull()) {
        fail(key, described(node) + "; expected a map of options");
      }
      read_map(node, key);
    } else {
      fail(key, "unknown key; nearest valid key: " + nearest(key, table_.keys()));
    }
  }

  void read_objects(const std::string& section, const YAML::Node& node) {
    if (!node.IsMap() && !node.IsNull()) {
      fail(section, described(node) + "; expected a map of named objects");
    }
    // The objects first, so that a misspelt key of one finds its neighbours.
    for (const auto& entry : node) {
      line_ = entry.first.Mark().line + 1;
      const std::string object = entry.first.IsScalar() ? entry.first.Scalar() : "";
      try {
        table_.create_object(section, object);
      } catch (const Error& error) {
        fail(section + "." + object, error.what());
      }
    }
    read_map(node, section);
  }

  void read_petsc_option(const std::string& key, const std::string& name, const YAML::Node& node) {
    if (const Option* ours = table_.find_name(name)) {
      fail(key, "not an option of PETSc's; expected at " + ours->key());
    }
    if (const auto meant = table_.meant_name(name)) {
      fail(key, "not an option of PETSc's; nearest option: -" + *meant);
    }
    PetscOption option{name, std::nullopt, path_ + ":" + std::to_string(line_) + ": " + key};
    if (node.IsSequence()) {
      std::string list;
      for (const YAML::Node& item : node) {
        if (!item.IsScalar()) {
          fail(key, "a list of lists; expected a value or a list");
        }
        list += (list.empty() ? "" : ",") + item.Scalar();
      }
      option.value = list;
    } else if (node.IsScalar() && node.Scalar() != "true") {
      option.value = node.Scalar();
    }
    set_petsc_option(petsc_, option);
  }

  static WrittenValue written_value(const Option& option, const YAML::Node& node) {
    WrittenValue written;
    if (node.IsScalar()) {
      written.rows = {{node.Scalar()}};
    } else if (node.IsSequence()) {
      written.kind = node.size() > 0 && node[0].IsSequence() ? WrittenValue::Kind::rows : WrittenValue::Kind::list;
      if (written.kind == WrittenValue::Kind::list) {
        written.rows = {words(option, node)};
      } else {
        for (const YAML::Node& row : node) {
          if (!row.IsSequence()) {
            throw Error("rows and single entries are mixed; expected " + option.expected());
          }
          written.rows.push_back(words(option, row));
        }
      }
    } else {
      throw Error(described(node) + "; expected " + option.expected());
    }
    return written;
  }

  static std::vector<std::string> words(const Option& option, const YAML::Node& list) {
    std::vector<std::string> words;
    for (const YAML::Node& item : list) {
      if (!item.IsScalar()) {
        throw Error("an entry of the list is " + described(item) + "; expected " + option.expected());
      }
      words.push_back(item.Scalar());
    }
    return words;
  }

  static std::string described(const YAML::Node& node) {
    return node.IsMap()        ? "a map"
           : node.IsSequence() ? "a list"
           : node.IsNull()     ? "no value"
                               : "\"" + node.Scalar() + "\"";
  }

  [[noreturn]] void fail(const std::string& key, const std::string& problem) const {
    throw Error(path_ + ":" + std::to_string(line_) + ": " + key + ": " + problem);
  }

  const std::string& path_;
  OptionTable& table_;
  std::vector<PetscOption>& petsc_;
  int line_ = 1;
};

void emit_value(YAML::Emitter& out, const Option& option) {
  const WrittenValue written = option.value();
  if (written.kind == WrittenValue::Kind::scalar) {
    out << written.rows.front().front();
  } else if (written.kind == WrittenValue::Kind::list) {
    out << YAML::Flow << written.rows.front();
  } else {
    out << YAML::Flow << YAML::BeginSeq;
    for (const auto& row : written.rows) {
      out << YAML::Flow << row;
    }
    out << YAML::EndSeq;
  }
  if (option.unit() != "1") {
    out << YAML::Comment(option.unit());
  }
}

/// Writes the entries of a map: the options whose keys begin with `start`. A group stands where its first option does.
void emit_group(YAML::Emitter& out, const std::vector<const Option*>& options, const std::string& start) {
  std::map<std::string, std::vector<const Option*>> groups;
  for (const Option* option : options) {
    const std::string rest = option->key().substr(start.size());
    groups[rest.substr(0, rest.find('.'))].push_back(option);
  }
  for (const Option* option : options) {
    const std::string rest = option->key().substr(start.size());
    const std::string word = rest.substr(0, rest.find('.'));
    if (groups[word].front() != option) {
      continue;
    }
    out << YAML::Key << word << YAML::Value;
    if (rest == word) {
      emit_value(out, *option);
    } else {
      out << YAML::BeginMap;
      emit_group(out, groups[word], start + word + ".");
      out << YAML::EndMap;
    }
  }
}

}  // namespace

void read_deck(const Deck& deck, OptionTable& table, std::vector<PetscOption>& petsc) {
  std::vector<YAML::Node> documents;
  try {
    documents = YAML::LoadAll(deck.text);
  } catch (const YAML::Exception& error) {
    throw Error(deck.path + ":" + std::to_string(error.mark.line + 1) + ": YAML syntax: " + error.msg +
                "; expected maps such as heat: {diffusivity: 2e-3}");
  }
  if (documents.size() > 1) {
    throw Error(deck.path + ": has " + std::to_string(documents.size()) + " YAML documents; expected one");
  }
  if (documents.empty() || documents.front().IsNull()) {
    return;
  }
  if (!documents.front().IsMap()) {
    throw Error(deck.path + ":1: not a map; expected options such as heat: {diffusivity: 2e-3}");
  }
  DeckReader(deck.path, table, petsc).read_map(documents.front(), "");
}

std::string written_deck(const OptionTable& table, const std::vector<PetscOption>& petsc) {
  YAML::Emitter out;
  std::vector<const Option*> options;
  for (const Option& option : table.options()) {
    options.push_back(&option);
  }
  out << YAML::BeginMap;
  emit_group(out, options, "");
  if (!petsc.empty()) {
    out << YAML::Key << "petsc" << YAML::Value << YAML::BeginMap;
    for (const PetscOption& option : petsc) {
      out << YAML::Key << option.name << YAML::Value << option.value.value_or("true");
    }
    out << YAML::EndMap;
  }
  out << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

}  // namespace pellicle
