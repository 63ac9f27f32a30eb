#pragma once

#include <petscmat.h>

#include <algorithm>
#include <vector>

#include "base/error.h"

namespace pellicle {
inline namespace linear {

/// A member function as PETSc calls it for a shell matrix, whose context is the object.
template <auto method>
struct ShellCallback;
template <class Self, class... Arguments, void (Self::*method)(Arguments...)>
struct ShellCallback<method> {
  static PetscErrorCode call(Mat shell, Arguments... arguments) noexcept {
    return as_petsc_callback([&] {
      Self* self = nullptr;
      check(MatShellGetContext(shell, &self));
      (self->*method)(arguments...);
    });
  }
};
template <class Self, class... Arguments, void (Self::*method)(Arguments...) const>
struct ShellCallback<method> {
  static PetscErrorCode call(Mat shell, Arguments... arguments) noexcept {
    return as_petsc_callback([&] {
      const Self* self = nullptr;
      check(MatShellGetContext(shell, &self));
      (self->*method)(arguments...);
    });
  }
};

/// Gives a shell matrix an operation of its context. Not collective.
/// @tparam method with the arguments that PETSc gives the operation after the matrix
template <auto method>
void set_shell_operation(Mat matrix, MatOperation operation) {
  check(MatShellSetOperation(matrix, operation, reinterpret_cast<void (*)()>(&ShellCallback<method>::call)));
}

/// The product of a symmetric matrix. Not collective.
template <auto multiply>
void set_symmetric_product(Mat matrix) {
  set_shell_operation<multiply>(matrix, MATOP_MULT);
  set_shell_operation<multiply>(matrix, MATOP_MULT_TRANSPOSE);
}

/// Copies the values of this rank's rows to a vector. Not collective.
template <class Values>
void copy_to(Vec vector, const Values& values) {
  double* array = nullptr;
  check(VecGetArrayWrite(vector, &array));
  std::copy(values.begin(), values.end(), array);
  check(VecRestoreArrayWrite(vector, &array));
}

}  // namespace linear
}  // namespace pellicle
