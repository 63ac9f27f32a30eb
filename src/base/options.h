#pragma once

#include <mpi.h>

#include <Eigen/Core>
#include <iosfwd>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace pellicle {

/// Key points: rows of equal length. YAML `[[0 s, 0, 0, 0], [1 s, 1, 0, 0]]`; on the command line `0,0,0,0;1,1,0,0`.
using Rows = std::vector<std::vector<double>>;

/// One declared option: everything that the deck reader, the command line, `-help` and the manual know of it.
/// The default is the value that the variable holds when it is declared.
class Option {
 public:
  using Variable = std::variant<bool*, int*, double*, std::string*, std::optional<double>*, Eigen::Vector3d*,
                                std::vector<double>*, std::vector<int>*, std::vector<std::string>*, Rows*>;

  Option(std::string key, Variable variable);

  /// SI unit of the stored value, such as "m" or "1/(K s)"; "1", a pure number, unless said. Rows: one unit a column,
  /// separated by commas.
  Option& unit(std::string text);
  /// Allowed values, both ends included.
  Option& range(double lowest, double highest);
  Option& at_least(double lowest);
  Option& more_than(double bound);
  /// The names that a string option takes.
  Option& choices(std::vector<std::string> names);
  /// How many numbers a list must have; any number unless said.
  Option& length(int count);
  Option& help(std::string text);
  /// Paper and equation, or where the default comes from.
  Option& source(std::string text);

  // The declaration is read by the option table alone; see options.cpp for what belongs here.
};

/// Every option of the program, grouped by the first word of its key (the module).
///
/// A key such as "heat.diffusivity" is `heat: {diffusivity: ...}` in a deck and `-heat_diffusivity` on the command line.
class OptionTable {
 public:
  OptionTable();
  ~OptionTable();

  /// Declares an option stored in `variable`, which must outlive the table. @throws std::logic_error on a second use.
  Option& add(std::string key, Option::Variable variable);

  /// Declares named objects: `bodies: {ball: {radius: 0.2 m}}`, `-bodies_ball_radius 0.2`. The keys that
  /// `describe(table, object)` adds are relative to the object. A deck creates an object by naming it; the command
  /// line changes objects that a deck has created.
  template <class T>
  void add_objects(std::string section, std::map<std::string, T>& objects, std::string help);

  /// Names solver prefixes such as "project_" or "heat_": below one of them a PETSc solver option (`ksp_...`,
  /// `pc_...`, `sub_...`, ...) goes to PETSc's options database instead of being an error.
  /// `variants` such as {"red_", "green_"} may follow the prefix; PETSc options given for the prefix alone are
  /// handed to every variant that does not set them itself.
  void add_solver_prefix(std::string prefix, std::vector<std::string> variants = {});
};

}  // namespace pellicle
