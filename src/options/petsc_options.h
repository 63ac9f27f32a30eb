#pragma once

#include <mpi.h>

#include <optional>
#include <string>
#include <vector>

#include "options/object_tables.h"

namespace pellicle::options {

/// A PETSc option from a deck or the command line.
struct PetscOption {
  std::string name;                  ///< without the dash and without object_prefix
  std::optional<std::string> value;  ///< none: the name alone, which PETSc takes for true
  Origin origin;                     ///< place at which the user wrote it
  std::string object = {};           ///< object whose solvers it is for; empty: all
  bool has_acted = false;            ///< as Option::has_acted
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

}  // namespace pellicle::options
