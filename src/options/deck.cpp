#include "options/deck.h"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>

#include "base/error.h"
#include "options/spelling.h"

namespace pellicle::options {

namespace {

/// Refuses a deck whose aliases contain themselves or multiply: a small file that grows without bound when it is read,
/// since yaml-cpp follows aliases to any depth.
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
  std::map<YAML::anchor_t, std::size_t> sizes_;  ///< of completed nodes with an anchor
};

const char* const objects_key = "objects";

bool is_merge(const YAML::Node& key) { return key.IsScalar() && key.Scalar() == "<<"; }

/// Calls visit(key, node) for each node that a map includes by the merge key: `<<: *map` or `<<: [*map, *other]`.
template <class Visit>
void for_each_merged(const YAML::Node& map, const Visit& visit) {
  for (const auto& entry : map) {
    if (is_merge(entry.first) && entry.second.IsSequence()) {
      for (const YAML::Node& node : entry.second) {
        visit(entry.first, node);
      }
    } else if (is_merge(entry.first)) {
      visit(entry.first, entry.second);
    }
  }
}

/// Walks the maps of one deck.
class DeckReader {
 public:
  DeckReader(const Deck& deck, const ObjectTables& tables, std::vector<PetscOption>& petsc)
      : path_(deck.path),
        folder_(std::filesystem::path(deck.source()).parent_path().string()),
        is_laid_over_(deck.is_laid_over),
        tables_(tables),
        given_to_(tables.of("")),
        petsc_(petsc) {}

  /// Reads the whole deck. @returns whether it sets an option or names an object
  bool read(const YAML::Node& root) {
    read_map(root, "");
    read_objects_of_run(root);
    return sets_something_;
  }

 private:
  using Entries = std::vector<std::pair<YAML::Node, YAML::Node>>;

  /// Adds the entries of a map, first those of the maps that it includes, so that its own override them, as earlier
  /// ones of these do later ones.
  void add_entries(const YAML::Node& map, const std::string& parent, Entries& entries) {
    const std::string start = parent.empty() ? "" : parent + ".";
    std::vector<YAML::Node> others;
    for_each_merged(map, [&](const YAML::Node& key, const YAML::Node& node) {
      line_ = key.Mark().line + 1;
      if (!node.IsMap()) {
        fail(start + "<<", "not an alias of a map; expected one, or a list of them");
      }
      others.push_back(node);
    });
    for (auto other = others.rbegin(); other != others.rend(); ++other) {
      add_entries(*other, parent, entries);
    }
    std::map<std::string, int> first_lines;
    for (const auto& entry : map) {
      if (is_merge(entry.first)) {
        continue;
      }
      line_ = entry.first.Mark().line + 1;
      const auto [first, is_new] = first_lines.emplace(entry.first.Scalar(), line_);
      if (!is_new && entry.first.IsScalar()) {
        fail(start + first->first,
             "duplicate key, first given in line " + std::to_string(first->second) + "; expected once");
      }
      entries.emplace_back(entry.first, entry.second);
    }
  }

  /// Calls visit(key, node) for the entries of a map in their order, with line_ at each.
  template <class Visit>
  void for_each_entry(const YAML::Node& map, const std::string& parent, const Visit& visit) {
    Entries entries;
    add_entries(map, parent, entries);
    for (const auto& [key, node] : entries) {
      line_ = key.Mark().line + 1;
      visit(key, node);
    }
  }

  void read_map(const YAML::Node& map, const std::string& parent) {
    for_each_entry(map, parent, [&](const YAML::Node& name, const YAML::Node& node) {
      if (!name.IsScalar()) {
        fail(parent.empty() ? "deck" : parent, "a key that is no word; expected the name of an option");
      }
      const std::string key = parent.empty() ? name.Scalar() : parent + "." + name.Scalar();
      if (name.Scalar().find('.') != std::string::npos) {
        fail(key, "a key with dots; expected nested maps such as heat: {diffusivity: ...}");
      }
      if (!object_.empty() || key != objects_key) {
        read_entry(key, node);
      }
    });
  }

  /// Reads the options of single objects, after those of all.
  void read_objects_of_run(const YAML::Node& root) {
    for_each_entry(root, "", [&](const YAML::Node& key, const YAML::Node& objects) {
      if (key.Scalar() == objects_key) {
        for_each_entry(objects, objects_key, [&](const YAML::Node& name, const YAML::Node& options) {
          object_ = name.Scalar();
          sets_something_ = true;
          given_to_ = tables_.of(object_);
          if (!options.IsMap() && !options.IsNull()) {
            fail("", described(options) + "; expected a map of options");
          }
          read_map(options, "");
          object_.clear();
          given_to_ = tables_.of("");
        });
      }
    });
  }

  void read_entry(const std::string& key, const YAML::Node& node) {
    const bool in_petsc = starts_with(key, "petsc.");
    const OptionTable& table = *given_to_.front().table;
    if (const Option* declared = given_to_.front().table->find_key(key)) {
      refuse_in_object(key, declared->is_of_run());
      sets_something_ = true;
      for (const ObjectTable& object : given_to_) {
        Option& option = *object.table->find_key(key);
        try {
          WrittenValue written = written_value(option, node);
          option.resolve(written, folder_);
          option.give(written, origin(key));
        } catch (const Error& error) {
          fail(key, error.what());
        }
      }
    } else if (const auto* section = table.find_section(key)) {
      refuse_in_object(key, section->rules.is_of_run());
      read_objects(key, node);
    } else if (!node.IsMap() && (in_petsc || table.is_solver_option(command_line_name(key)))) {
      refuse_in_object(key, in_petsc);
      read_petsc_option(key, command_line_name(in_petsc ? key.substr(6) : key), node);
    } else if (key == "petsc" || in_petsc || table.is_group(key)) {
      if (!node.IsMap() && !node.IsNull()) {
        fail(key, described(node) + "; expected a map of options");
      }
      read_map(node, key);
    } else {
      fail(key, "unknown key; nearest valid key: " + full_key(nearest(key, table.keys())));
    }
  }

  /// @param is_of_run whether the option can only be given for the run as a whole
  void refuse_in_object(const std::string& key, bool is_of_run) const {
    if (is_of_run && !object_.empty()) {
      fail(key, "is of the run and not of one of its objects; expected " + key + " at the top of the deck");
    }
  }

  /// Creates the objects first, so that a misspelt key of one finds its neighbours.
  void read_objects(const std::string& section, const YAML::Node& node) {
    if (!node.IsMap() && !node.IsNull()) {
      fail(section, described(node) + "; expected a map of named objects");
    }
    for_each_entry(node, section, [&](const YAML::Node& name, const YAML::Node&) {
      sets_something_ = true;
      for (const ObjectTable& one : given_to_) {
        try {
          one.table->create_object(section, name.Scalar(), origin(section + "." + name.Scalar()));
        } catch (const Error& error) {
          fail(section + "." + name.Scalar(), error.what());
        }
      }
    });
    read_map(node, section);
  }

  void read_petsc_option(const std::string& key, const std::string& name, const YAML::Node& node) {
    const auto [named, rest] = tables_.split_name(name);
    const std::string& object = object_.empty() ? named : object_;
    const OptionTable& table = *given_to_.front().table;
    if (const Option* ours = table.find_name(rest)) {
      fail(key, "not an option of PETSc's; expected at " + ours->key());
    }
    if (const auto meant = table.meant_name(rest)) {
      fail(key, "not an option of PETSc's; nearest option: -" + object_prefix(object) + *meant);
    }
    sets_something_ = true;
    PetscOption option{rest, std::nullopt, origin(key), object};
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
    petsc_.push_back(std::move(option));
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

  /// The key with the name of its object, if it is in one.
  std::string full_key(const std::string& key) const {
    return object_.empty() ? key : std::string(objects_key) + "." + object_ + (key.empty() ? "" : "." + key);
  }
  Origin origin(const std::string& key) const { return {path_, line_, full_key(key), is_laid_over_}; }

  [[noreturn]] void fail(const std::string& key, const std::string& problem) const {
    throw Error(origin(key).text() + ": " + problem);
  }

  const std::string& path_;
  const std::string folder_;  ///< where relative names of files start
  bool is_laid_over_;
  const ObjectTables& tables_;
  std::string object_;                 ///< whose options are being read; empty: all objects
  std::vector<ObjectTable> given_to_;  ///< objects to which the options apply
  std::vector<PetscOption>& petsc_;
  bool sets_something_ = false;
  int line_ = 1;
};

void emit_value(YAML::Emitter& out, const Option& option) {
  WrittenValue written = option.value();
  if (option.unit() == "rad") {  // Beyond a full turn an angle must name it.
    for (auto& row : written.rows) {
      for (std::string& word : row) {
        word += " rad";
      }
    }
  }
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
  struct Group {
    std::string key;
    std::vector<const Option*> options;
  };
  std::vector<Group> groups;
  for (const Option* option : options) {
    const std::string key = option->key().substr(0, option->key().find('.', start.size()));
    Group* known = first_that(groups, [&key](const Group& group) { return group.key == key; });
    if (known == nullptr) {
      known = &groups.emplace_back(Group{key, {}});
    }
    known->options.push_back(option);
  }
  for (const Group& group : groups) {
    out << YAML::Key << group.key.substr(start.size()) << YAML::Value;
    if (group.options.front()->key() == group.key) {
      emit_value(out, *group.options.front());
    } else {
      out << YAML::BeginMap;
      emit_group(out, group.options, group.key + ".");
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
    // Stops at the second document: in some texts that are not YAML the parser finds new documents without end.
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
  if (!starts_with(file.filename().string(), "deck_")) {
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

namespace {

[[noreturn]] void refuse_objects(const std::string& path, const YAML::Node& node, const std::string& problem) {
  throw Error(path + ":" + std::to_string(node.Mark().line + 1) + ": " + objects_key + ": " + problem +
              "; expected a map of named objects such as cloth: {mesh: {shape: square}}");
}

/// Calls visit(map) for the maps that a map includes, at any depth, and then for itself.
template <class Visit>
void for_each_included(const YAML::Node& map, const Visit& visit) {
  for_each_merged(map, [&](const YAML::Node&, const YAML::Node& other) {
    if (other.IsMap()) {
      for_each_included(other, visit);
    }
  });
  visit(map);
}

/// Adds the names of the objects of a deck. DeckReader reports malformed maps, except that of the objects.
void add_objects(const std::string& path, const YAML::Node& root, std::vector<std::string>& names) {
  const auto add_names = [&](const YAML::Node& objects) {
    for (const auto& entry : objects) {
      const std::string name = entry.first.IsScalar() ? entry.first.Scalar() : "";
      if (!is_merge(entry.first) && !is_word(name)) {
        refuse_objects(path, entry.first, "\"" + name + "\" is no name, which has letters, digits and underscores");
      }
      if (!is_merge(entry.first) && std::find(names.begin(), names.end(), name) == names.end()) {
        names.push_back(name);
      }
    }
  };
  for_each_included(root, [&](const YAML::Node& map) {
    if (const YAML::Node objects = map[objects_key]) {
      if (!objects.IsMap() || objects.size() == 0) {
        refuse_objects(path, objects, "names no object");
      }
      for_each_included(objects, add_names);
    }
  });
}

}  // namespace

ObjectTables tables_of(const std::vector<Deck>& decks, OptionTable& one,
                       const std::function<OptionTable&(const std::string& object)>& make_table) {
  std::vector<std::string> names;
  for (const Deck& deck : decks) {
    const YAML::Node root = parse(deck.path, deck.text);
    if (root.IsMap()) {
      add_objects(deck.path, root, names);
    }
  }
  std::vector<ObjectTable> tables;
  for (const std::string& name : names) {
    tables.push_back({name, &make_table(name)});
  }
  return tables.empty() ? ObjectTables(one) : ObjectTables(std::move(tables));
}

bool read_deck(const Deck& deck, const ObjectTables& tables, std::vector<PetscOption>& petsc) {
  const YAML::Node root = parse(deck.path, deck.text);
  if (!root.IsMap() && !root.IsNull()) {
    throw Error(deck.path + ":1: not a map; expected options such as heat: {diffusivity: 2e-3}");
  }
  const bool sets_something = root.IsMap() && DeckReader(deck, tables, petsc).read(root);
  keep_last(petsc);
  return sets_something;
}

namespace {

/// The values of a deck by key, such as "heat.diffusivity"; lists as they are written.
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

namespace {

bool acts(const Option& option) { return option.idle_because() == nullptr; }

/// Writes the options for which `is_wanted` holds.
template <class IsWanted>
void emit_options(YAML::Emitter& out, const OptionTable& table, const IsWanted& is_wanted) {
  std::vector<const Option*> options;
  for (const Option& option : table.options()) {
    if (is_wanted(option)) {
      options.push_back(&option);
    }
  }
  emit_group(out, options, "");
}

}  // namespace

std::string written_deck(const ObjectTables& tables, const std::vector<PetscOption>& petsc) {
  YAML::Emitter out;
  out << YAML::BeginMap;
  if (tables.are_named()) {
    // An option of the run as a whole acts if it acts in one of the objects.
    emit_options(out, *tables.front().table, [&tables](const Option& option) {
      const auto acts_in = [&option](const ObjectTable& object) { return acts(*object.table->find_key(option.key())); };
      return option.is_of_run() && std::any_of(tables.begin(), tables.end(), acts_in);
    });
    out << YAML::Key << objects_key << YAML::Value << YAML::BeginMap;
    for (const ObjectTable& object : tables) {
      out << YAML::Key << object.name << YAML::Value << YAML::BeginMap;
      emit_options(out, *object.table, [](const Option& option) { return acts(option) && !option.is_of_run(); });
      out << YAML::EndMap;
    }
    out << YAML::EndMap;
  } else {
    emit_options(out, *tables.front().table, acts);
  }
  if (!petsc.empty()) {
    out << YAML::Key << "petsc" << YAML::Value << YAML::BeginMap;
    for (const PetscOption& option : petsc) {
      out << YAML::Key << database_name(option) << YAML::Value << option.value.value_or("true");
    }
    out << YAML::EndMap;
  }
  out << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

}  // namespace pellicle::options
