#pragma once

#include <mpi.h>

#include <optional>
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

/// A PETSc option from a deck or the command line.
struct PetscOption {
  std::string name;                  ///< without the dash and without object_prefix
  std::optional<std::string> value;  ///< none: the name alone, which PETSc takes for true
  Origin origin;                     ///< place at which the user wrote it
  std::string object = {};           ///< object whose solvers it is for; empty: all
};

/// The name of an option in PETSc's options database.
std::string database_name(const PetscOption& option);

/// Keeps the last of several options with the same name in the database.
void keep_last(std::vector<PetscOption>& options);

/// The options as arguments of PetscInitialize; those of a general solver prefix are copied to the variants that do not
/// set them, those for all objects to each object that does not set them.
std::vector<std::string> petsc_arguments(const std::vector<PetscOption>& options, const ObjectTables& tables);

/// One line for each unused option in PETSc's database, by the name that the user wrote. An option that was copied has
/// one line, and only if no copy was used.
std::vector<std::string> unused_petsc_options(const std::vector<PetscOption>& options, const ObjectTables& tables);

/// Prints `unused_petsc_options` on rank 0's standard error. To be called after all solvers have been set up.
void warn_unused(MPI_Comm comm, const std::vector<PetscOption>& options, const ObjectTables& tables);

/// Notes which of the options given so far have an effect (OptionTable::note_acting).
void note_acting(const ObjectTables& tables, std::vector<PetscOption>& petsc);

/// Finds, after everything has been read, given options without effect in any of their objects. They are legal if they
/// had an effect after the deck with them had been read, or if they are solver settings in a deck laid over a scene;
/// they are then named once. PETSc's options of solvers that the run does not have are removed from `petsc`.
/// @returns one line that names the unused options; "" if there are none
/// @throws Error that names the first illegal one, and what it needs
std::string settle_idle_options(const ObjectTables& tables, std::vector<PetscOption>& petsc);

}  // namespace pellicle::options
