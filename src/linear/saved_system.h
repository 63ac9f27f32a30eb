#pragma once

#include <petscksp.h>

#include <string>

#include "base/namespaces.h"

namespace pellicle::linear {

/// Writes the matrix from which the preconditioner is made, and the right-hand side, to the file that the option
/// `-<prefix>save_system` names, if it is given. Each solve overwrites the file, so that the last one remains. PETSc's
/// binary format, matrix first. Collective. @throws Error for a matrix that is not assembled
void save_systems(KSP ksp, const std::string& prefix);

/// Reads such a file, solves the system by the solver of the options `-replay_...` and prints its size, the solver,
/// iterations, times and the true residual. Collective. @throws Error on a file that cannot be read, and when the
/// solver does not converge
void replay(MPI_Comm comm, const std::string& file);

}  // namespace pellicle::linear
