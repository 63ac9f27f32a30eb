#pragma once

#include <string>
#include <utility>
#include <vector>

#include "options/options.h"

namespace pellicle::options {

/// An object of a run with the table of its options.
struct ObjectTable {
  std::string name;  ///< empty: the run's only object, without a name
  OptionTable* table;
};

/// The tables of the objects of a run: those in the decks' `objects: {NAME: {...}}`, or one object without a name.
/// Options at the top of a deck apply to every object, those in an object to that one. On the command line
/// `-heat_capacity` applies to every object, `-objects_NAME_heat_capacity` to one.
class ObjectTables {
 public:
  /// The table of a run of one object without a name. @param table must outlive this object
  ObjectTables(OptionTable& table) : tables_{{"", &table}} {}  // NOLINT(google-explicit-constructor): it is one table
  /// The tables of named objects. @param tables not empty
  explicit ObjectTables(std::vector<ObjectTable> tables) : tables_(std::move(tables)) {}

  bool are_named() const { return !tables_.front().name.empty(); }
  const ObjectTable& front() const { return tables_.front(); }
  auto begin() const { return tables_.begin(); }
  auto end() const { return tables_.end(); }
  /// The table of a name, or all tables if the name is empty.
  std::vector<ObjectTable> of(const std::string& object) const;

  /// The object in a name on the command line (without the dash), and the rest of the name:
  /// "objects_cloth_heat_capacity" gives "cloth" and "heat_capacity". If there is no such object: "" and the name.
  std::pair<std::string, std::string> split_name(const std::string& name) const;

 private:
  std::vector<ObjectTable> tables_;
};

/// The beginning of the names of an object's options on the command line, which is also the prefix of its solvers in
/// PETSc: "objects_cloth_"; "" for an object without a name.
std::string object_prefix(const std::string& object);

}  // namespace pellicle::options
