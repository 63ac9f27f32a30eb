#pragma once

#include <string>
#include <vector>

#include "base/object_tables.h"
#include "base/petsc_options.h"

namespace pellicle {
inline namespace base {

/// Notes which of the options given so far have an effect, see OptionTable::note_acting.
void note_acting(const ObjectTables& tables, std::vector<PetscOption>& petsc);

/// Finds, when everything has been read, what was given but has no effect in this run, in none of the objects to which
/// it was given. It is legal if it had an effect when the deck that gives it had been read, and if it is a solver
/// setting in a deck that is laid over a scene; then it is named once. PETSc's options of solvers that the run does not
/// have are taken out of `petsc`.
/// @returns one line that names what is not used; "" when all is
/// @throws Error that names the first that is not legal, and what it needs
std::string settle_idle_options(const ObjectTables& tables, std::vector<PetscOption>& petsc);

}  // namespace base
}  // namespace pellicle
