#pragma once

#include <string>
#include <vector>

#include "options/object_tables.h"
#include "options/petsc_options.h"

namespace pellicle::options {

/// Notes which of the options given so far have an effect (OptionTable::note_acting).
void note_acting(const ObjectTables& tables, std::vector<PetscOption>& petsc);

/// Finds, after everything has been read, given options without effect in any of their objects. They are legal if they
/// had an effect after the deck with them had been read, or if they are solver settings in a deck laid over a scene;
/// they are then named once. PETSc's options of solvers that the run does not have are removed from `petsc`.
/// @returns one line that names the unused options; "" if there are none
/// @throws Error that names the first illegal one, and what it needs
std::string settle_idle_options(const ObjectTables& tables, std::vector<PetscOption>& petsc);

}  // namespace pellicle::options
