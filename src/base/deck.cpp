#include "base/deck.h"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>

#include "base/error.h"
#include "base/spelling.h"

namespace pellicle {

namespace {

/// Refuses a deck that is small as a file but not when it is read: one whose aliases contain themselves, or multiply.
/// yaml-cpp follows such aliases to any depth.
class ExpansionCheck : public YAML::EventHandler {
 public:
  explicit ExpansionCheck(const std::string& path) : path_(path) {}

  void OnDocumentStart(const YAML::Mark&) override {
    open_.clear();
    sizes_.clear();
  }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override { add(mark, anchor, 1); }
  void OnScalar(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor, const std::string&) override {
    add(mark, anchor, 1);
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    const auto size = sizes_.find(anchor);
    if (size == sizes_.end()) {
      fail(mark, "an alias of the list or map that it stands in; expected one that does not contain itself");
    }
    add(mark, YAML::NullAnchor, size->second);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    open(mark, anchor);
  }
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    open(mark, anchor);
  }
  void OnSequenceEnd() override { close(); }
  void OnMapEnd() override { close(); }

 private:
  /// A list or map that has not ended.
  struct Open {
    YAML::Mark mark;
    YAML::anchor_t anchor;
    std::size_t size;  ///< nodes so far, aliases written out
  };

  void open(const YAML::Mark& mark, YAML::anchor_t anchor) {
    constexpr std::size_t deepest = 50;
    if (open_.size() == deepest) {
      fail(mark, "lists and maps nested more than " + std::to_string(deepest) + " deep; expected fewer");
    }
    open_.push_back({mark, anchor, 1});
  }
  void add(const YAML::Mark& mark, YAML::anchor_t anchor, std::size_t size) {
    constexpr std::size_t most_nodes = 1000000;
    if (anchor != YAML::NullAnchor) {
      sizes_[anchor] = size;
    }
    if (!open_.empty()) {
      open_.back().size += size;
      if (open_.back().size > most_nodes) {
        fail(mark,
             "more than " + std::to_string(most_nodes) + " entries where its aliases are written out; expected fewer");
      }
    }
  }
  void close() {
    const Open ended = open_.back();
    open_.pop_back();
    add(ended.mark, ended.anchor, ended.size);
  }
  [[noreturn]] void fail(const YAML::Mark& mark, const std::string& problem) const {
    throw Error(path_ + ":" + std::to_string(mark.line + 1) + ": YAML: " + problem);
  }

  const std::string& path_;
  std::vector<Open> open_;
  std::map<YAML::anchor_t, std::size_t> sizes_;  ///< of what ended and has an anchor
};

/// Walks the maps of one deck.
class DeckReader {
 public:
  DeckReader(const Deck& deck, OptionTable& table, std::vector<PetscOption>& petsc)
      : path_(deck.path),
        folder_(std::filesystem::path(deck.source()).parent_path().string()),
        is_laid_over_(deck.is_laid_over),
        table_(table),
        petsc_(petsc) {}

  void read_map(const YAML::Node& map, const std::string& parent) {
    // First what the map takes over from others, so that its own entries count.
    const std::vector<YAML::Node> others = merged_maps(map, parent);
    for (auto other = others.rbegin(); other != others.rend(); ++other) {
      read_map(*other, parent);
    }
    std::map<std::string, int> first_lines;
    for (const auto& entry : map) {
      line_ = entry.first.Mark().line + 1;
      if (is_merge(entry.first)) {
        continue;
      }
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
  static bool is_merge(const YAML::Node& key) { return key.IsScalar() && key.Scalar() == "<<"; }

  /// The maps behind the merge key `<<: *map` or `<<: [*map, *other]`, of which the first counts most.
  std::vector<YAML::Node> merged_maps(const YAML::Node& map, const std::string& parent) {
    std::vector<YAML::Node> maps;
    for (const auto& entry : map) {
      if (!is_merge(entry.first)) {
        continue;
      }
      line_ = entry.first.Mark().line + 1;
      if (entry.second.IsSequence()) {
        for (const YAML::Node& other : entry.second) {
          maps.push_back(other);
        }
      } else {
        maps.push_back(entry.second);
      }
      if (!std::all_of(maps.begin(), maps.end(), [](const YAML::Node& node) { return node.IsMap(); })) {
        fail((parent.empty() ? "" : parent + ".") + "<<", "not an alias of a map; expected one, or a list of them");
      }
    }
    return maps;
  }

  void read_entry(const std::string& key, const YAML::Node& node) {
    const bool in_petsc = key.compare(0, 6, "petsc.") == 0;
    if (Option* option = table_.find_key(key)) {
      try {
        WrittenValue written = written_value(*option, node);
        option->resolve(written, folder_);
        option->give(written, origin(key));
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
    create_objects(section, node);
    read_map(node, section);
  }

  /// The objects first, so that a misspelt key of one finds its neighbours.
  void create_objects(const std::string& section, const YAML::Node& node) {
    for (const YAML::Node& other : merged_maps(node, section)) {
      create_objects(section, other);
    }
    for (const auto& entry : node) {
      line_ = entry.first.Mark().line + 1;
      if (is_merge(entry.first)) {
        continue;
      }
      const std::string object = entry.first.IsScalar() ? entry.first.Scalar() : "";
      try {
        table_.create_object(section, object, origin(section + "." + object));
      } catch (const Error& error) {
        fail(section + "." + object, error.what());
      }
    }
  }

  void read_petsc_option(const std::string& key, const std::string& name, const YAML::Node& node) {
    if (const Option* ours = table_.find_name(name)) {
      fail(key, "not an option of PETSc's; expected at " + ours->key());
    }
    if (const auto meant = table_.meant_name(name)) {
      fail(key, "not an option of PETSc's; nearest option: -" + *meant);
    }
    PetscOption option{name, std::nullopt, origin(key)};
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

  Origin origin(const std::string& key) const { return {path_, line_, key, is_laid_over_}; }

  [[noreturn]] void fail(const std::string& key, const std::string& problem) const {
    throw Error(origin(key).text() + ": " + problem);
  }

  const std::string& path_;
  const std::string folder_;  ///< where relative names of files start
  bool is_laid_over_;
  OptionTable& table_;
  std::vector<PetscOption>& petsc_;
  int line_ = 1;
};

void emit_value(YAML::Emitter& out, const Option& option) {
  const WrittenValue written = option.value_with_unit();
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

/// The one document of a YAML file; null if there is none. @throws Error
YAML::Node parse(const std::string& path, const std::string& text) {
  try {
    std::istringstream stream(text);
    YAML::Parser parser(stream);
    ExpansionCheck expansion(path);
    // No further than the second document: in some texts that are not YAML the parser finds new ones without end.
    if (parser.HandleNextDocument(expansion) && parser.HandleNextDocument(expansion)) {
      throw Error(path + ": has several YAML documents; expected one");
    }
    return YAML::Load(text);
  } catch (const YAML::Exception& error) {
    throw Error(path + ":" + std::to_string(error.mark.line + 1) + ": YAML syntax: " + error.msg +
                "; expected maps such as heat: {diffusivity: 2e-3}");
  }
}

}  // namespace

std::string original_of(const std::string& path) {
  const std::filesystem::path file(path);
  if (file.filename().string().compare(0, 5, "deck_") != 0) {
    return "";
  }
  try {
    const std::string path_of_record = (file.parent_path() / "run.yaml").string();
    std::ifstream stream(path_of_record);
    const std::string text((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
    const YAML::Node record = parse(path_of_record, text);
    for (const YAML::Node& deck : record["decks"]) {
      if (deck["copy"].as<std::string>() == file.filename().string()) {
        return deck["copy_of"].as<std::string>();
      }
    }
  } catch (const YAML::Exception&) {  // No record of a run lies there,
  } catch (const Error&) {            // or something else of this name.
  }
  return "";
}

void read_deck(const Deck& deck, OptionTable& table, std::vector<PetscOption>& petsc) {
  const YAML::Node root = parse(deck.path, deck.text);
  if (root.IsNull()) {
    return;
  }
  if (!root.IsMap()) {
    throw Error(deck.path + ":1: not a map; expected options such as heat: {diffusivity: 2e-3}");
  }
  DeckReader(deck, table, petsc).read_map(root, "");
}

namespace {

/// Values by key, "heat.diffusivity"; lists as they are written.
void flatten(const YAML::Node& node, const std::string& key, std::map<std::string, std::string>& values) {
  if (!node.IsMap()) {
    values[key] = YAML::Dump(node);
    return;
  }
  for (const auto& entry : node) {
    const auto name = entry.first.as<std::string>();
    flatten(entry.second, key.empty() ? name : key + "." + name, values);
  }
}

}  // namespace

std::vector<ChangedOption> changed_options(const std::string& before, const std::string& now) {
  std::map<std::string, std::array<std::string, 2>> both;
  for (const std::size_t k : {0U, 1U}) {
    std::map<std::string, std::string> values;
    try {
      flatten(YAML::Load(k == 0 ? before : now), "", values);
    } catch (const YAML::Exception& exception) {
      throw Error(std::string("the options of a run cannot be read: ") + exception.what());
    }
    for (const auto& [key, value] : values) {
      both[key][k] = value;
    }
  }
  std::vector<ChangedOption> changed;
  for (const auto& [key, values] : both) {
    if (values[0] != values[1]) {
      changed.push_back({key, values[0], values[1]});
    }
  }
  return changed;
}

std::string written_deck(const OptionTable& table, const std::vector<PetscOption>& petsc) {
  YAML::Emitter out;
  std::vector<const Option*> options;
  for (const Option& option : table.options()) {
    if (option.idle_because() == nullptr) {
      options.push_back(&option);
    }
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
