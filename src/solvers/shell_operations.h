#pragma once

#include <petscmat.h>

#include <algorithm>
#include <vector>

#include "base/error.h"

namespace pellicle {
inline namespace solvers {

/// Gives a shell matrix, whose context is a Self, its operations: the product, of a symmetric matrix, and the diagonal
/// of this rank's rows. Not collective.
template <class Self, void (Self::*multiply)(Vec in, Vec out), const std::vector<double>& (Self::*diagonal)() const>
void set_shell_operations(Mat matrix) {
  PetscErrorCode (*product)(Mat, Vec, Vec) = [](Mat shell, Vec in, Vec out) {
    return as_petsc_callback([&] {
      Self* self = nullptr;
      check(MatShellGetContext(shell, &self));
      (self->*multiply)(in, out);
    });
  };
  PetscErrorCode (*get_diagonal)(Mat, Vec) = [](Mat shell, Vec out) {
    return as_petsc_callback([&] {
      Self* self = nullptr;
      double* values = nullptr;
      check(MatShellGetContext(shell, &self));
      check(VecGetArrayWrite(out, &values));
      const std::vector<double>& entries = (self->*diagonal)();
      std::copy(entries.begin(), entries.end(), values);
      check(VecRestoreArrayWrite(out, &values));
    });
  };
  check(MatShellSetOperation(matrix, MATOP_MULT, reinterpret_cast<void (*)()>(product)));
  check(MatShellSetOperation(matrix, MATOP_MULT_TRANSPOSE, reinterpret_cast<void (*)()>(product)));
  check(MatShellSetOperation(matrix, MATOP_GET_DIAGONAL, reinterpret_cast<void (*)()>(get_diagonal)));
}

}  // namespace solvers
}  // namespace pellicle
