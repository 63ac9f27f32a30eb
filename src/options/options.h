#pragma once

#include <Eigen/Core>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "base/sorting.h"
#include "options/choice.h"

namespace pellicle::options {

/// Key points: rows of equal length. YAML `[[0 s, 0, 0, 0], [1 s, 1, 0, 0]]`; on the command line `0,0,0,0;1,1,0,0`.
using Rows = std::vector<std::vector<double>>;

/// The value of an option as it was written, not yet converted: a scalar has one row of one word, a list one row.
struct WrittenValue {
  enum class Kind { scalar, list, rows };
  Kind kind = Kind::scalar;
  std::vector<std::vector<std::string>> rows;
};

/// Place at which a user gave an option.
struct Origin {
  std::string source;  ///< "input/deck.yaml", "command line"
  int line = 0;        ///< 0: the source has no lines
  std::string name;    ///< as it is written there: "heat.diffusivity", "-heat_diffusivity"
  /// Whether the source is laid over a scene and may be meant for many scenes: a deck after the first, PETSc's files
  /// and environment.
  bool is_laid_over = false;
  bool has_acted = false;  ///< whether what is given had an effect after the source, or a later one, had been read

  /// "input/deck.yaml:3: heat.diffusivity", as messages begin.
  std::string text() const { return source + (line > 0 ? ":" + std::to_string(line) : "") + ": " + name; }
};

/// A condition for an option to have an effect.
struct Condition {
  std::string words;  ///< "mesh.shape: torus, roof"
  std::function<bool()> holds;
};

/// The first condition that does not hold; null if all hold.
inline const Condition* first_unmet(const std::vector<Condition>& conditions) {
  return first_that(conditions, [](const Condition& condition) { return !condition.holds(); });
}

/// The condition that the option `key`, stored in `variable`, has one of some values.
Condition one_of_names(const std::string& key, const AnyChoice& variable, std::vector<std::string> values);
template <class E>
Condition one_of(const std::string& key, const Choice<E>& variable, const std::vector<E>& values) {
  std::vector<std::string> names;
  for (const E value : values) {
    names.push_back(Choice<E>(value).name());
  }
  return one_of_names(key, variable, std::move(names));
}
/// The condition that the option `key` is given: the text, the list or the optional number in `variable` is not empty.
template <class T>
Condition is_given(const std::string& key, const T& variable) {
  return {key, [&variable] { return !variable.empty(); }};
}
template <class T>
Condition is_given(const std::string& key, const std::optional<T>& variable) {
  return {key, [&variable] { return variable.has_value(); }};
}
/// The condition that the number `variable` of the option `key` is more than 0.
template <class Number>
Condition is_positive(const std::string& key, const Number& variable) {
  return {key + ": more than 0", [&variable] { return variable > 0; }};
}

/// The rules of an option: its unit, allowed values, conditions for its effect, and meaning. The rules of a length are
/// `Rules("m").more_than(0)`.
class Rules {
 public:
  Rules() = default;
  /// @param unit as `unit` takes it
  explicit Rules(std::string unit) { this->unit(std::move(unit)); }

  /// SI unit of the stored value, such as "m" or "1/(K s)"; by default "1", a pure number. For Rows: one unit a column,
  /// separated by commas. @throws std::logic_error if it is not an SI unit.
  Rules& unit(std::string text);
  /// Allowed values of every number, both ends included; for key points, Rows that begin with a time, of the numbers
  /// after the time.
  Rules& range(double lowest, double highest) { return at_least(lowest).at_most(highest); }
  Rules& at_least(double lowest) { return set(lowest_, lowest); }
  Rules& at_most(double highest) { return set(highest_, highest); }
  /// Like at_least and at_most, without the bound itself.
  Rules& more_than(double bound) { return set(above_, bound); }
  Rules& less_than(double bound) { return set(below_, bound); }
  /// The names that a string option takes; a Choice brings its own.
  Rules& choices(std::vector<std::string> names) { return set(choices_, std::move(names)); }
  /// Number of entries of a list (for Rows: of a row); any number by default.
  Rules& length(int count) { return set(length_, static_cast<std::size_t>(count)); }
  /// Marks the value as the name of a file: a relative path in a deck starts at the deck's folder, on the command line
  /// at the present one; the variable gets an absolute path.
  Rules& file() { return set(is_file_, true); }
  /// Marks a file that a run does not read again when it continues from a checkpoint: its content may have changed.
  Rules& not_read_again() { return set(is_read_again_, false); }
  /// Refuses an empty value on the command line; in a deck, such as one written by a run, it means that nothing is
  /// given. @param expected description of the value
  Rules& needs_value(std::string expected) { return set(expected_text_, std::move(expected)); }
  Rules& help(std::string text) { return set(help_, std::move(text)); }
  /// Adds a condition for an effect of the option, which is checked after all options have been read. All conditions
  /// must hold.
  Rules& acts_with(Condition condition) {
    conditions_.push_back(std::move(condition));
    return *this;
  }
  /// Adds what the rules of a group of options say of their effect, the conditions before the option's own.
  Rules& under(const Rules& outer);
  /// Marks an option of a solver, not of the problem: a deck laid over a scene may set it for a chain that the run does
  /// not have.
  Rules& solver_setting() { return set(is_solver_setting_, true); }
  /// Marks an option of the run as a whole: in a deck with `objects` it stands at the top, and in none of them.
  Rules& of_run() { return set(is_of_run_, true); }
  /// Paper and equation, or the source of the default.
  Rules& source(std::string text) { return set(source_, std::move(text)); }

  const std::string& unit() const { return unit_; }
  const std::string& help() const { return help_; }
  const std::string& source() const { return source_; }
  bool is_solver_setting() const { return is_solver_setting_; }
  bool is_of_run() const { return is_of_run_; }
  /// Whether the value names a file that a run reads again when it continues from a checkpoint.
  bool is_read_again() const { return is_file_ && is_read_again_; }
  bool needs_value() const { return !expected_text_.empty(); }
  const std::vector<Condition>& conditions() const { return conditions_; }

 protected:
  std::string unit_ = "1";
  std::vector<std::string> units_{"1"};  ///< of each column; a single entry is for all
  std::optional<double> lowest_;
  std::optional<double> highest_;
  std::optional<double> above_;  ///< itself not allowed
  std::optional<double> below_;  ///< itself not allowed
  std::vector<std::string> choices_;
  std::optional<std::size_t> length_;
  bool is_file_ = false;
  bool is_read_again_ = true;
  std::string expected_text_;  ///< given to needs_value
  bool is_solver_setting_ = false;
  bool is_of_run_ = false;
  std::vector<Condition> conditions_;
  std::string help_;
  std::string source_;

 private:
  template <class Member, class Value>
  Rules& set(Member& member, Value&& value) {
    member = std::forward<Value>(value);
    return *this;
  }
};

/// A declared option, for the deck reader, the command line, `-help` and the manual. The default is the value of the
/// variable at the declaration.
class Option : public Rules {
 public:
  using Variable = std::variant<bool*, int*, double*, std::string*, std::optional<double>*, Eigen::Vector3d*,
                                std::vector<double>*, std::vector<int>*, std::vector<std::string>*, Rows*, AnyChoice*>;

  Option(std::string key, Variable variable, Rules rules);

  /// "heat.diffusivity"
  const std::string& key() const { return key_; }
  /// "heat_diffusivity": the name on the command line, without the dash.
  const std::string& name() const { return name_; }
  /// The value at declaration, in SI without its unit.
  const std::string& default_text() const { return default_text_; }
  /// "0 to 1", "at least 0", "3 numbers", the choices unless they are many; empty if all values are allowed.
  std::string range_text() const;
  bool is_flag() const { return holds<bool>(); }
  /// The first condition of the option that does not hold; null: it acts.
  const Condition* idle_because() const { return first_unmet(conditions_); }
  /// Whether the value means that nothing is given: an empty text or list, or none.
  bool is_blank() const;

  /// The variable's value now, in SI, without its unit.
  WrittenValue value() const;

  /// Splits a value of the command line: lists at commas, Rows at semicolons too.
  WrittenValue from_command_line(const std::string& text) const;

  /// Makes the name of a file absolute (`file`); does not change other values.
  void resolve(WrittenValue& written, const std::string& folder) const;

  /// Checks a value and stores it. @throws Error with the fault and the expected value, without the key.
  void assign(const WrittenValue& written);
  /// Assigns a user's value, and keeps its origin. @throws Error as assign does.
  void give(const WrittenValue& written, Origin origin);

  /// Origin of the last given value; none if there is none.
  const std::optional<Origin>& origin() const { return origin_; }
  /// Notes in the origin if the option has an effect now.
  void note_acting();

  /// Description of the expected value: "a length such as 0.3 mm, at least 0".
  std::string expected() const;

 private:
  /// Whether the variable is of one of some types.
  template <class... Types>
  bool holds() const {
    return (std::holds_alternative<Types*>(variable_) || ...);
  }
  double number(const std::string& word, const std::string& unit, bool has_range = true) const;
  int integer(const std::string& word) const;
  std::string chosen(const std::string& word) const;
  void check_range(double value, const std::string& word) const;
  bool has_key_points() const { return holds<Rows>() && units_.size() > 1 && units_.front() == "s"; }
  /// "0 to 1", "more than 0, at most 5"; empty: any number. @param unit of every bound, " K", or nothing
  std::string limits(const std::string& unit) const;
  [[noreturn]] void refuse(const std::string& problem) const;
  const std::string& column_unit(std::size_t column) const { return units_[units_.size() > 1 ? column : 0]; }

  std::string key_;
  std::string name_;
  Variable variable_;
  std::optional<Origin> origin_;
  std::string default_text_;
};

/// A prefix of PETSc solver options, "project_", and the variants that may follow it, {"red_", "green_"}.
struct SolverPrefix {
  std::string prefix;
  std::vector<std::string> variants;
  std::vector<Condition> conditions;  ///< conditions for the run to have these solvers
};

/// Every option of the program, grouped by the first word of its key (the module).
///
/// A key such as "heat.diffusivity" is `heat: {diffusivity: ...}` in a deck and `-heat_diffusivity` on the command
/// line. Solver options of PETSc stand below a solver prefix, `project: {ksp_type: cg}`; `petsc: {log_view: true}`
/// holds others.
class OptionTable {
 public:
  /// A named object that a deck has created.
  struct Object {
    std::string name;
    Origin origin;  ///< of the deck that named it last
  };

  /// Named objects of one kind, such as all bodies.
  struct ObjectSection {
    std::string key;   ///< "bodies"
    std::string name;  ///< "bodies": of the command line
    std::string help;
    std::deque<Option> prototype;  ///< options of an object, with keys such as "bodies.NAME.radius"
    std::vector<Object> objects;   ///< in the order of their creation
    Rules rules;                   ///< of all their options: conditions, and whether they are of the run
    std::function<void(OptionTable&, const std::string& object)> describe;  ///< "" is the prototype
  };

  OptionTable() = default;
  OptionTable(const OptionTable&) = delete;
  OptionTable& operator=(const OptionTable&) = delete;

  /// Declares an option stored in `variable`, which must outlive the table. Top-level keys have no dot ("dynamics").
  /// @throws std::logic_error if the key, or its name on the command line, is in use.
  Option& add(const std::string& key, Option::Variable variable, Rules rules = {});
  template <class T>
  Option& add(const std::string& key, T& variable) {
    return add(key, Option::Variable(&variable));
  }
  /// Declares an option as a row of the manual's table has it.
  template <class T>
  void add(const std::string& key, T& variable, Rules rules, std::string help, std::string source = "") {
    add(key, Option::Variable(&variable), rules.help(std::move(help)).source(std::move(source)));
  }
  template <class T>
  void add(const std::string& key, T& variable, std::string help, std::string source = "") {
    add(key, variable, Rules(), std::move(help), std::move(source));
  }

  /// Declares named objects: `bodies: {ball: {radius: 0.2 m}}`, `-bodies_ball_radius 0.2`. The keys that
  /// `describe(table, object)` adds are relative to the object. A deck creates an object by naming it; the command
  /// line changes objects that a deck has created.
  template <class T, class Describe>
  void add_objects(const std::string& section, std::map<std::string, T>& objects, const std::string& help,
                   const Describe& describe_object) {
    auto prototype = std::make_shared<T>();
    add_object_section(section, help,
                       [&objects, prototype, describe_object](OptionTable& table, const std::string& object) {
                         describe_object(table, object.empty() ? *prototype : objects[object]);
                       });
  }
  template <class T>
  void add_objects(const std::string& section, std::map<std::string, T>& objects, const std::string& help) {
    add_objects(section, objects, help, [](OptionTable& table, T& object) { describe(table, object); });
  }

  /// Declares the options, objects and solver prefixes that `declare` adds under a condition for their effect. May be
  /// nested.
  void add_under(const Condition& condition, const std::function<void()>& declare) {
    add_with(Rules().acts_with(condition), declare);
  }
  /// Declares options that are all solver settings (Rules::solver_setting).
  void add_solver_settings(const std::function<void()>& declare) { add_with(Rules().solver_setting(), declare); }
  /// Declares options and named objects that all belong to the run as a whole (Rules::of_run).
  void add_of_run(const std::function<void()>& declare) { add_with(Rules().of_run(), declare); }
  /// Sets a function that derives options from others after each deck has been read, where the deck leaves some out.
  void follow_decks(std::function<void()> follow) { follow_decks_ = std::move(follow); }

  /// Two options that an object cannot have together.
  struct Exclusion {
    std::string option;           ///< such as "time.arc_length"
    std::string other;            ///< such as "force.air_density"
    std::string expected;         ///< expected value of `option`: "none"
    std::function<bool()> holds;  ///< whether the object has both
  };
  void exclude(Exclusion exclusion) { exclusions_.push_back(std::move(exclusion)); }
  const std::vector<Exclusion>& exclusions() const { return exclusions_; }
  /// Checks the exclusions after everything has been read. @throws Error if the object has both options of one
  void check_exclusions() const;

  /// Names solver prefixes such as "project_" or "heat_": below one of them a PETSc solver option (`ksp_...`,
  /// `pc_...`, `sub_...`, ...) goes to PETSc's options database instead of being an error.
  /// `variants` such as {"red_", "green_"} may follow the prefix; PETSc options given for the prefix alone are
  /// handed to every variant that does not set them itself.
  void add_solver_prefix(std::string prefix, std::vector<std::string> variants = {}) {
    solver_prefixes_.push_back({std::move(prefix), std::move(variants), common_.conditions()});
  }

  /// The declared options and those of the objects created so far, in that order.
  std::deque<Option>& options() { return options_; }
  const std::deque<Option>& options() const { return options_; }
  const std::deque<ObjectSection>& object_sections() const { return sections_; }
  const std::vector<SolverPrefix>& solver_prefixes() const { return solver_prefixes_; }

  /// The option of a key or of a name on the command line (without the dash); null: none.
  Option* find_key(const std::string& key) {
    return first_that(options_, [&](const Option& option) { return option.key() == key; });
  }
  Option* find_name(const std::string& name) {
    return first_that(options_, [&](const Option& option) { return option.name() == name; });
  }
  const Option* find_name(const std::string& name) const {
    return first_that(options_, [&](const Option& option) { return option.name() == name; });
  }
  /// The section of named objects of a key; null: none.
  const ObjectSection* find_section(const std::string& key) const {
    return first_that(sections_, [&](const ObjectSection& section) { return section.key == key; });
  }
  /// The prototype's option for a name with an object that need not exist: "bodies_ball_radius" gives the radius; null:
  /// none.
  const Option* find_prototype(const std::string& name) const;
  /// Whether decks may write a map at this key ("heat", "bodies.ball", "project.red").
  bool is_group(const std::string& key) const;
  /// All keys that a deck may hold: options, objects and groups.
  std::vector<std::string> keys() const;

  /// Adds an object to a section, or renews its origin. @throws Error if the name is not a word or its options would
  /// have the name of others on the command line.
  void create_object(const std::string& section, const std::string& object, const Origin& origin = {});

  /// Runs follow_decks, and notes which options have an effect. Must be called after a deck has been read. These count
  /// as intended, even if a later deck or the command line violates their conditions.
  void note_acting();

  /// The solver prefix of a PETSc option's name (without the dash); null: none.
  const SolverPrefix* solver_of(const std::string& name) const;
  bool is_solver_option(const std::string& name) const { return solver_of(name) != nullptr; }
  /// The names under which the variants of a solver prefix read a PETSc option that was given for the prefix alone.
  std::vector<std::string> variant_names(const std::string& name) const;
  /// The program's option that the user may have meant by an unknown name (without the dash): if the name begins like
  /// one of its modules, or differs by at most two letters from one of its options. None if it may be PETSc's.
  std::optional<std::string> meant_name(const std::string& name) const;

 private:
  /// Declares options that are all under the same rules.
  void add_with(Rules rules, const std::function<void()>& declare);
  void add_object_section(const std::string& section, std::string help,
                          std::function<void(OptionTable&, const std::string& object)> describe);

  std::deque<Option> options_;
  std::deque<ObjectSection> sections_;
  std::vector<SolverPrefix> solver_prefixes_;
  std::string base_;                        ///< "bodies.ball." while an object is described
  std::deque<Option>* target_ = &options_;  ///< to which `add` adds options
  Rules common_;                            ///< of the options being added
  std::function<void()> follow_decks_ = [] {};
  std::vector<Exclusion> exclusions_;
};

/// Whether a text can be the name of an object: letters, digits and underscores, a letter first.
bool is_word(const std::string& text);

/// The name on the command line, without the dash, of a key: dots become underscores.
std::string command_line_name(const std::string& key);

/// The text of `-help`: purpose and call of the program, and every option by module; lines of up to 100 letters.
std::string help_text(const OptionTable& table);

/// The text of `-options_table`: Markdown, one table a module.
std::string options_markdown(const OptionTable& table);

}  // namespace pellicle::options
