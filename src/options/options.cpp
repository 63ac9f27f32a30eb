#include "options/options.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <limits>
#include <set>
#include <stdexcept>
#include <type_traits>

#include "base/error.h"
#include "base/units.h"
#include "options/spelling.h"

namespace pellicle::options {

namespace {

// The first words of PETSc's options for solvers, and of the prefixes that PETSc 3.18 gives the solvers nested in one;
// and save_system (linear/saved_system.h).
constexpr std::array<const char*, 38> solver_words{
    "ksp_",         "pc_",        "snes_",   "mat_",       "dm_",           "linesearch_", "npc_",       "fas_",
    "mg_",          "gamg_",      "hmg_",    "sub_",       "esteig_",       "fieldsplit_", "schur_",     "inner_",
    "upper_",       "redundant_", "repart_", "telescope_", "redistribute_", "deflation_",  "galerkin_",  "fetidp_",
    "exotic_",      "gdsw_",      "nn_",     "lsc_",       "mpi_",          "lmvm_",       "multigrid_", "exact_",
    "approximate_", "hierarch_",  "power_",  "pseudo_",    "harmonic_",     "save_system"};

// PETSc's options that are suggested when one is misspelt.
constexpr std::array<const char*, 5> common_solver_options{"ksp_type", "ksp_rtol", "ksp_max_it", "ksp_monitor",
                                                           "pc_type"};

bool ends_with(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

bool is_solver_word(const std::string& rest) {
  return std::any_of(solver_words.begin(), solver_words.end(),
                     [&](const char* word) { return starts_with(rest, word); });
}

std::string first_word(const std::string& name) { return name.substr(0, name.find('_')); }

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  if (trimmed(text).empty()) {
    return parts;
  }
  std::size_t begin = 0;
  while (true) {
    const std::size_t end = text.find(separator, begin);
    parts.push_back(trimmed(text.substr(begin, end == std::string::npos ? end : end - begin)));
    if (end == std::string::npos) {
      return parts;
    }
    begin = end + 1;
  }
}

template <class Numbers>
std::vector<std::string> number_words(const Numbers& numbers) {
  std::vector<std::string> words;
  for (const auto number : numbers) {
    words.push_back(number_text(number));
  }
  return words;
}

std::string word_of(bool flag) { return flag ? "true" : "false"; }
std::string word_of(int number) { return std::to_string(number); }
std::string word_of(double number) { return number_text(number); }
std::string word_of(const std::string& text) { return text; }
std::string word_of(const AnyChoice& choice) { return choice.name(); }
std::string word_of(const std::optional<double>& number) { return number ? number_text(*number) : "none"; }

/// If an option has more choices, its help says what they are.
constexpr std::size_t most_listed_choices = 20;

template <class T>
inline constexpr bool is_list = std::is_same_v<T, Eigen::Vector3d> || std::is_same_v<T, std::vector<double>> ||
                                std::is_same_v<T, std::vector<int>> || std::is_same_v<T, std::vector<std::string>>;

}  // namespace

void AnyChoice::set(const std::string& name) {
  const auto found = std::find(names_->begin(), names_->end(), name);
  if (found == names_->end()) {
    throw Error("\"" + name + "\" is not a choice, the nearest is " + nearest(name, *names_));
  }
  index_ = static_cast<std::size_t>(found - names_->begin());
}

Rules& Rules::unit(std::string text) {
  unit_ = std::move(text);
  units_ = split(unit_, ',');
  for (const std::string& column : units_) {
    const Unit parsed = parse_unit(column);
    if (parsed.factor != 1 || parsed.offset != 0) {
      throw std::logic_error("unit " + column + " of an option is not SI");
    }
  }
  if (units_.size() > 1) {
    length_ = units_.size();
  }
  return *this;
}

Rules& Rules::under(const Rules& outer) {
  conditions_.insert(conditions_.begin(), outer.conditions_.begin(), outer.conditions_.end());
  is_solver_setting_ = is_solver_setting_ || outer.is_solver_setting_;
  is_of_run_ = is_of_run_ || outer.is_of_run_;
  return *this;
}

Option::Option(std::string key, Variable variable, Rules rules)
    : Rules(std::move(rules)), key_(std::move(key)), name_(command_line_name(key_)), variable_(variable) {
  if (holds<Eigen::Vector3d>()) {
    length_ = 3;
  }
  if (const auto* choice = std::get_if<AnyChoice*>(&variable_)) {
    choices_ = (*choice)->names();
  }
  std::vector<std::string> rows;
  const WrittenValue initial = value();
  for (const auto& row : initial.rows) {
    rows.push_back(join(row, ", "));
  }
  default_text_ = join(rows, "; ");
}

bool Option::is_blank() const {
  const WrittenValue now = value();
  return now.rows.empty() || now.rows.front().empty() || now.rows.front().front().empty() ||
         (holds<std::optional<double>>() && now.rows.front().front() == "none");
}

std::string Option::range_text() const {
  std::vector<std::string> parts;
  if (length_) {
    parts.push_back(std::to_string(*length_) + (holds<Rows>() ? " numbers a row" : " numbers"));
  }
  if (!choices_.empty() && choices_.size() <= most_listed_choices) {
    parts.push_back(join(choices_, ", "));
  }
  if (const std::string allowed = limits(""); !allowed.empty()) {
    parts.push_back((has_key_points() ? "behind the time " : "") + allowed);
  }
  return join(parts, "; ");
}

std::string Option::limits(const std::string& unit) const {
  std::vector<std::string> parts;
  const auto add = [&](const std::string& words, const std::optional<double>& bound) {
    if (bound) {
      parts.push_back(words + number_text(*bound) + unit);
    }
  };
  const bool is_interval = lowest_ && highest_;
  add(is_interval ? number_text(*lowest_) + " to " : "at least ", is_interval ? highest_ : lowest_);
  add("more than ", above_);
  add("at most ", is_interval ? std::nullopt : highest_);
  add("less than ", below_);
  return join(parts, ", ");
}

std::string Option::expected() const {
  std::string element = needs_value() ? expected_text_ : "text";
  if (!choices_.empty()) {
    element = "one of " + join(choices_, ", ");
  } else if (is_flag()) {
    element = "true or false";
  } else if (holds<int, std::vector<int>>()) {
    element = "an integer";
  } else if (!holds<std::string, std::vector<std::string>>()) {
    element = units_.size() > 1 ? "numbers in " + unit_ : example_of(unit_);
  }
  const std::string allowed = limits(unit_ == "1" || units_.size() > 1 ? "" : " " + unit_);
  if (!allowed.empty()) {
    element += (has_key_points() ? ", behind the time " : ", ") + allowed;
  }
  if (holds<std::optional<double>>()) {
    return "none or " + element;
  }
  const std::string count = length_ ? " of " + std::to_string(*length_) : "";
  if (holds<Rows>()) {
    return "a list of rows" + count + (length_ ? "" : " of equal length") + ", " + element;
  }
  return holds<bool, int, double, std::string, AnyChoice>() ? element : "a list" + count + ", each " + element;
}

WrittenValue Option::value() const {
  return std::visit(
      [](const auto* variable) -> WrittenValue {
        using T = std::remove_const_t<std::remove_pointer_t<decltype(variable)>>;
        using Kind = WrittenValue::Kind;
        if constexpr (std::is_same_v<T, Rows>) {
          WrittenValue written{Kind::rows, {}};
          for (const auto& row : *variable) {
            written.rows.push_back(number_words(row));
          }
          return written;
        } else if constexpr (std::is_same_v<T, std::vector<std::string>>) {
          return {Kind::list, {*variable}};
        } else if constexpr (is_list<T>) {
          return {Kind::list, {number_words(*variable)}};
        } else {
          return {Kind::scalar, {{word_of(*variable)}}};
        }
      },
      variable_);
}

WrittenValue Option::from_command_line(const std::string& text) const {
  return std::visit(
      [&](auto* variable) -> WrittenValue {
        using T = std::remove_pointer_t<decltype(variable)>;
        if constexpr (std::is_same_v<T, Rows>) {
          WrittenValue written{WrittenValue::Kind::rows, {}};
          for (const std::string& row : split(text, ';')) {
            written.rows.push_back(split(row, ','));
          }
          return written;
        } else {
          return is_list<T> ? WrittenValue{WrittenValue::Kind::list, {split(text, ',')}}
                            : WrittenValue{WrittenValue::Kind::scalar, {{text}}};
        }
      },
      variable_);
}

void Option::resolve(WrittenValue& written, const std::string& folder) const {
  if (!is_file_ || written.kind != WrittenValue::Kind::scalar || written.rows.front().front().empty()) {
    return;
  }
  std::string& name = written.rows.front().front();
  name = std::filesystem::absolute(std::filesystem::path(folder) / name).lexically_normal().string();
}

void Option::give(const WrittenValue& written, Origin origin) {
  assign(written);
  origin_ = std::move(origin);
}

void Option::note_acting() {
  if (origin_ && idle_because() == nullptr) {
    origin_->has_acted = true;
  }
}

void Option::assign(const WrittenValue& written) {
  for (const auto& row : written.rows) {
    for (const std::string& word : row) {
      if (std::any_of(word.begin(), word.end(), [](unsigned char c) { return (c < 0x20 && c != '\t') || c == 0x7f; })) {
        refuse("\"" + word + "\" has control characters");
      }
    }
  }
  const auto read = [this](auto& value, const std::string& word, std::size_t column = 0) {
    using T = std::remove_reference_t<decltype(value)>;
    if constexpr (std::is_same_v<T, int>) {
      value = integer(word);
    } else if constexpr (std::is_same_v<T, std::string>) {
      value = chosen(word);
    } else {
      value = number(word, column_unit(column));
    }
  };
  std::visit(
      [&](auto* variable) {
        using T = std::remove_pointer_t<decltype(variable)>;
        using Kind = WrittenValue::Kind;
        if constexpr (std::is_same_v<T, Rows>) {
          const bool empty = written.kind == Kind::list && written.rows.front().empty();
          if (written.kind != Kind::rows && !empty) {
            refuse(written.kind == Kind::list ? "a list of single entries" : "a single value");
          }
          Rows rows;
          for (std::size_t i = 0; !empty && i < written.rows.size(); ++i) {
            const auto& words = written.rows[i];
            if (words.size() != length_.value_or(written.rows.front().size())) {
              refuse("row " + std::to_string(i + 1) + " has " + std::to_string(words.size()) + " entries");
            }
            rows.emplace_back();
            for (std::size_t column = 0; column < words.size(); ++column) {
              rows.back().push_back(number(words[column], column_unit(column), column > 0 || !has_key_points()));
            }
          }
          *variable = rows;
        } else if constexpr (is_list<T>) {
          // A list of any length may be one entry without brackets: `corners: all`.
          if (written.kind == Kind::rows || (written.kind == Kind::scalar && length_)) {
            refuse(written.kind == Kind::rows ? "a list of lists"
                                              : "\"" + written.rows.front().front() + "\" is no list");
          }
          const auto& words = written.rows.front();
          const bool is_default = words.empty() && default_text_.empty();
          if (length_ && words.size() != *length_ && !is_default) {
            refuse("the list has " + std::to_string(words.size()) + " entries");
          }
          T values = *variable;
          if constexpr (!std::is_same_v<T, Eigen::Vector3d>) {
            values.resize(words.size());
          }
          for (std::size_t i = 0; i < words.size(); ++i) {
            read(values[i], words[i], i);
          }
          *variable = values;
        } else {
          if (written.kind != Kind::scalar) {
            refuse("a list");
          }
          const std::string& word = written.rows.front().front();
          if constexpr (std::is_same_v<T, bool>) {
            const std::set<std::string> yes{"true", "yes", "on", "1"};
            if (yes.count(word) == 0 && std::set<std::string>{"false", "no", "off", "0"}.count(word) == 0) {
              refuse("\"" + word + "\"");
            }
            *variable = yes.count(word) > 0;
          } else if constexpr (std::is_same_v<T, AnyChoice>) {
            variable->set(chosen(word));
          } else if (std::is_same_v<T, std::optional<double>> && word == "none") {
            *variable = T();
          } else {
            read(*variable, word);
          }
        }
      },
      variable_);
}

double Option::number(const std::string& word, const std::string& unit, bool has_range) const {
  Quantity quantity;
  try {
    quantity = parse_quantity(word);
  } catch (const Error& error) {
    refuse(error.what());
  }
  if (!quantity.bare && quantity.dimension != parse_unit(unit).dimension) {
    refuse("\"" + word + "\" has the wrong dimension");
  }
  constexpr double full_turn = 6.283185307179586;
  if (quantity.bare && unit == "rad" && std::abs(quantity.value) > full_turn * (1 + 1e-4)) {  // 6.2832 is one
    throw Error(word + ": an angle of more than 2 pi without a unit; expected " + word + " deg or " + word + " rad");
  }
  if (has_range) {
    check_range(quantity.value, word);
  }
  return quantity.value;
}

int Option::integer(const std::string& word) const {
  int value = 0;
  const bool plus = word.size() > 1 && word[0] == '+' && word[1] != '-';
  const char* end = word.data() + word.size();
  const auto [last, failure] = std::from_chars(word.data() + (plus ? 1 : 0), end, value);
  if (failure == std::errc::result_out_of_range && last == end) {
    refuse("\"" + word + "\" is beyond the integers, " + std::to_string(std::numeric_limits<int>::min()) + " to " +
           std::to_string(std::numeric_limits<int>::max()));
  }
  if (failure != std::errc() || last != end) {
    refuse("\"" + word + "\" is not an integer");
  }
  check_range(value, word);
  return value;
}

std::string Option::chosen(const std::string& word) const {
  if (!choices_.empty() && std::find(choices_.begin(), choices_.end(), word) == choices_.end()) {
    refuse("\"" + word + "\" is not a choice, the nearest is " + nearest(word, choices_));
  }
  return word;
}

void Option::check_range(double value, const std::string& word) const {
  if ((lowest_ && value < *lowest_) || (highest_ && value > *highest_) || (above_ && value <= *above_) ||
      (below_ && value >= *below_)) {
    refuse("\"" + word + "\" is out of range");
  }
}

void Option::refuse(const std::string& problem) const { throw Error(problem + "; expected " + expected()); }

Option& OptionTable::add(const std::string& key, Option::Variable variable, Rules rules) {
  Option option(base_ + key, variable, std::move(rules.under(common_)));
  const auto collides = [&](const Option& other) {
    return other.name() == option.name() || starts_with(other.key(), option.key() + ".") ||
           starts_with(option.key(), other.key() + ".");
  };
  const bool in_section = base_.empty() && std::any_of(sections_.begin(), sections_.end(), [&](const ObjectSection& s) {
                            return starts_with(option.key() + ".", s.key + ".");
                          });
  if (in_section || std::any_of(target_->begin(), target_->end(), collides)) {
    throw std::logic_error("option " + option.key() + " is declared twice, or is a group as well");
  }
  return target_->emplace_back(std::move(option));
}

void OptionTable::add_with(Rules rules, const std::function<void()>& declare) {
  const Rules outer = std::exchange(common_, rules.under(common_));
  declare();
  common_ = outer;
}

void OptionTable::add_object_section(const std::string& section, std::string help,
                                     std::function<void(OptionTable&, const std::string& object)> describe) {
  ObjectSection& added = sections_.emplace_back();
  added.key = section;
  added.name = command_line_name(section);
  added.help = std::move(help);
  added.describe = std::move(describe);
  added.rules = common_;
  base_ = section + ".NAME.";
  target_ = &added.prototype;
  added.describe(*this, "");
  base_.clear();
  target_ = &options_;
}

const Option* OptionTable::find_prototype(const std::string& name) const {
  for (const ObjectSection& section : sections_) {
    const std::string start = section.name + "_";
    for (const Option& option : section.prototype) {
      const std::string end = option.name().substr(start.size() + std::string("NAME").size());
      if (starts_with(name, start) && ends_with(name, end) && name.size() > start.size() + end.size()) {
        return &option;
      }
    }
  }
  return nullptr;
}

namespace {

/// Whether `is` holds for one of the beginnings of the names of PETSc's options below a solver prefix.
template <class Is>
bool any_start(const SolverPrefix& solver, const Is& is) {
  return is(solver.prefix) || std::any_of(solver.variants.begin(), solver.variants.end(),
                                          [&](const std::string& variant) { return is(solver.prefix + variant); });
}

bool names_solver_option(const std::string& name, const std::string& start) {
  return starts_with(name, start) && is_solver_word(name.substr(start.size()));
}

}  // namespace

bool OptionTable::is_group(const std::string& key) const {
  const std::string name = command_line_name(key) + "_";
  const auto is_of_solver = [&name](const std::string& start) {
    return starts_with(start, name) || names_solver_option(name, start);
  };
  const auto below = [&](const auto& declared) { return starts_with(declared, key + "."); };
  return std::any_of(solver_prefixes_.begin(), solver_prefixes_.end(),
                     [&](const SolverPrefix& solver) { return any_start(solver, is_of_solver); }) ||
         std::any_of(options_.begin(), options_.end(), [&](const Option& option) { return below(option.key()); }) ||
         std::any_of(sections_.begin(), sections_.end(), [&](const ObjectSection& s) { return below(s.key); });
}

std::vector<std::string> OptionTable::keys() const {
  std::set<std::string> keys{"petsc"};
  const auto add_with_groups = [&](const std::string& key) {
    for (std::size_t dot = key.find('.'); dot != std::string::npos; dot = key.find('.', dot + 1)) {
      keys.insert(key.substr(0, dot));
    }
    keys.insert(key);
  };
  for (const Option& option : options_) {
    add_with_groups(option.key());
  }
  for (const ObjectSection& section : sections_) {
    add_with_groups(section.key);
  }
  for (const SolverPrefix& solver : solver_prefixes_) {
    const std::string group = solver.prefix.substr(0, solver.prefix.size() - 1);
    keys.insert(group);
    for (const char* option : common_solver_options) {
      keys.insert(group + "." + option);
    }
    for (const std::string& variant : solver.variants) {
      keys.insert(group + "." + variant.substr(0, variant.size() - 1));
    }
  }
  return {keys.begin(), keys.end()};
}

void OptionTable::note_acting() {
  follow_decks_();
  for (Option& option : options_) {
    option.note_acting();
  }
  for (ObjectSection& section : sections_) {
    for (Object& object : section.objects) {
      object.origin.has_acted = object.origin.has_acted || first_unmet(section.rules.conditions()) == nullptr;
    }
  }
}

void OptionTable::create_object(const std::string& section, const std::string& object, const Origin& origin) {
  ObjectSection* found = first_that(sections_, [&](const ObjectSection& s) { return s.key == section; });
  if (Object* known = first_that(found->objects, [&](const Object& other) { return other.name == object; })) {
    *known = {object, origin};
    return;
  }
  if (!is_word(object)) {
    throw Error("\"" + object + "\" is no name of an object; expected letters, digits and underscores");
  }
  for (const Option& option : found->prototype) {
    const std::string end = option.name().substr(found->name.size() + std::string("_NAME").size());
    const std::string name = found->name + "_" + object + end;
    if (const Option* other = find_name(name)) {
      throw Error("-" + name + " would also mean " + other->key() + "; expected another name of the object");
    }
  }
  found->objects.push_back({object, origin});
  base_ = section + "." + object + ".";
  add_with(found->rules, [&] { found->describe(*this, object); });
  base_.clear();
}

const SolverPrefix* OptionTable::solver_of(const std::string& name) const {
  const auto is_of = [&name](const std::string& start) { return names_solver_option(name, start); };
  return first_that(solver_prefixes_, [&](const SolverPrefix& solver) { return any_start(solver, is_of); });
}

std::vector<std::string> OptionTable::variant_names(const std::string& name) const {
  std::vector<std::string> names;
  for (const SolverPrefix& solver : solver_prefixes_) {
    if (names_solver_option(name, solver.prefix)) {
      for (const std::string& variant : solver.variants) {
        names.push_back(solver.prefix + variant + name.substr(solver.prefix.size()));
      }
    }
  }
  return names;
}

std::optional<std::string> OptionTable::meant_name(const std::string& name) const {
  if (is_solver_option(name)) {
    return std::nullopt;
  }
  const std::string module = first_word(name) + "_";
  const auto is_of_module = [&module](const std::string& other) { return starts_with(other + "_", module); };
  const bool begins_like_ours =
      std::any_of(options_.begin(), options_.end(),
                  [&](const Option& option) { return option.key() != option.name() && is_of_module(option.name()); }) ||
      std::any_of(sections_.begin(), sections_.end(), [&](const ObjectSection& s) { return is_of_module(s.name); }) ||
      std::any_of(solver_prefixes_.begin(), solver_prefixes_.end(),
                  [&](const SolverPrefix& solver) { return is_of_module(solver.prefix); });
  constexpr int most_letters = 2;  // that may be wrong; a short name has too many others within this distance
  if (!begins_like_ours && name.size() <= 4) {
    return std::nullopt;
  }
  std::vector<std::string> ours;
  const auto consider = [&](const std::string& other) {
    const auto longer = std::abs(static_cast<int>(other.size()) - static_cast<int>(name.size()));
    if (begins_like_ours || longer <= most_letters) {  // A larger difference in length means more wrong letters.
      ours.push_back(other);
    }
  };
  for (const char* flag : {"help", "options_table", "version"}) {
    consider(flag);
  }
  for (const Option& option : options_) {
    consider(option.name());
  }
  for (const SolverPrefix& solver : solver_prefixes_) {
    for (const char* option : common_solver_options) {
      consider(solver.prefix + option);
    }
  }
  const std::string closest = nearest(name, ours);
  return begins_like_ours || (!ours.empty() && edit_distance(name, closest) <= most_letters) ? std::optional(closest)
                                                                                             : std::nullopt;
}

Condition one_of_names(const std::string& key, const AnyChoice& variable, std::vector<std::string> values) {
  const std::string words = key + ": " + join(values, ", ");
  return {words, [&variable, values = std::move(values)] {
            return std::find(values.begin(), values.end(), variable.name()) != values.end();
          }};
}

void OptionTable::check_exclusions() const {
  for (const Exclusion& exclusion : exclusions_) {
    if (exclusion.holds()) {
      const bool is_key = exclusion.option.find(':') == std::string::npos;
      throw Error(exclusion.option + (is_key ? ": " : " ") + "does not go with " + exclusion.other + ", expected " +
                  exclusion.expected);
    }
  }
}

bool is_word(const std::string& text) {
  return !text.empty() && std::isalpha(static_cast<unsigned char>(text[0])) != 0 &&
         std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; });
}

std::string command_line_name(const std::string& key) {
  std::string name = key;
  std::replace(name.begin(), name.end(), '.', '_');
  return name;
}

}  // namespace pellicle::options
