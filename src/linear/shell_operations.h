#pragma once

#include <petscmat.h>

#include <Eigen/Core>
#include <algorithm>

#include "base/handle.h"

namespace pellicle::linear {

/// A member function as PETSc calls it for a shell matrix, whose context is the object.
template <auto method, class Self, class... Arguments>
PetscErrorCode call_on_context(Mat shell, Arguments... arguments) noexcept {
  return as_petsc_callback([&] {
    Self* self = nullptr;
    check(MatShellGetContext(shell, &self));
    (self->*method)(arguments...);
  });
}
template <auto method, class Self, class... Arguments>
auto shell_callback(void (Self::*)(Arguments...)) {
  return &call_on_context<method, Self, Arguments...>;
}
template <auto method, class Self, class... Arguments>
auto shell_callback(void (Self::*)(Arguments...) const) {
  return &call_on_context<method, const Self, Arguments...>;
}

/// Gives a shell matrix an operation of its context. Not collective.
/// @tparam method with the arguments that PETSc gives the operation after the matrix
template <auto method>
void set_shell_operation(Mat matrix, MatOperation operation) {
  check(MatShellSetOperation(matrix, operation, reinterpret_cast<void (*)()>(shell_callback<method>(method))));
}

/// A symmetric shell matrix. Collective.
/// @tparam multiply its product with vectors @param rows of this rank @param self context, for all operations
template <auto multiply, class Self>
MatHandle symmetric_shell(MPI_Comm comm, PetscInt rows, Self* self) {
  MatHandle shell;
  check(MatCreateShell(comm, rows, rows, PETSC_DETERMINE, PETSC_DETERMINE, self, shell.create()));
  set_shell_operation<multiply>(shell, MATOP_MULT);
  set_shell_operation<multiply>(shell, MATOP_MULT_TRANSPOSE);
  return shell;
}

/// The values of this rank's rows of a vector, which PETSc lends until the end of the scope. Not collective.
template <class Vector, auto get, auto restore>
class LentValues : public Eigen::Map<Vector> {
 public:
  explicit LentValues(Vec vector) : Eigen::Map<Vector>(array_of(vector), rows_of(vector)), vector_(vector) {}
  LentValues(const LentValues&) = delete;
  LentValues& operator=(const LentValues&) = delete;
  ~LentValues() {
    auto* array = this->data();
    restore(vector_, &array);
  }
  using Eigen::Map<Vector>::operator=;

 private:
  static auto* array_of(Vec vector) {
    typename Eigen::Map<Vector>::PointerType array = nullptr;
    check(get(vector, &array));
    return array;
  }
  static PetscInt rows_of(Vec vector) {
    PetscInt rows = 0;
    check(VecGetLocalSize(vector, &rows));
    return rows;
  }

  Vec vector_;
};
using VecValues = LentValues<Eigen::VectorXd, VecGetArray, VecRestoreArray>;
using ConstVecValues = LentValues<const Eigen::VectorXd, VecGetArrayRead, VecRestoreArrayRead>;

/// Copies the values of this rank's rows to a vector. Not collective.
template <class Values>
void copy_to(Vec vector, const Values& values) {
  std::copy(values.begin(), values.end(), VecValues{vector}.data());
}

}  // namespace pellicle::linear
