#pragma once

#include <mpi.h>

#include <optional>
#include <string>
#include <vector>

#include "base/object_tables.h"

namespace pellicle {
inline namespace base {

/// An option of PETSc's that a deck or the command line gives.
struct PetscOption {
  std::string name;                  ///< without the dash and without object_prefix
  std::optional<std::string> value;  ///< none: the name stands alone, which PETSc takes for true
  Origin origin;                     ///< where and how the user wrote it
  std::string object = {};           ///< whose solvers it is for; empty: all
  bool has_acted = false;            ///< as Option::has_acted
};

/// The name in PETSc's options database of an option as it was given.
std::string database_name(const PetscOption& option);

/// If several options have the same name in the database, the last one stays.
void keep_last(std::vector<PetscOption>& options);

/// The options as arguments of PetscInitialize, those of a general solver prefix handed to the variants that do not set
/// them themselves, and those for the solvers of all objects to each object that does not set them itself.
std::vector<std::string> petsc_arguments(const std::vector<PetscOption>& options, const ObjectTables& tables);

/// One line for each option in PETSc's database that nothing has used, by the name that the user wrote. An option
/// handed on counts once, and only when it was not used anywhere.
std::vector<std::string> unused_petsc_options(const std::vector<PetscOption>& options, const ObjectTables& tables);

/// Prints `unused_petsc_options` on rank 0's standard error. Call it when all solvers have been set up.
void warn_unused(MPI_Comm comm, const std::vector<PetscOption>& options, const ObjectTables& tables);

}  // namespace base
}  // namespace pellicle
