#pragma once

#include <petscvec.h>

#include "base/error.h"
#include "base/handle.h"
#include "parallel/field.h"
#include "parallel/layout.h"

namespace pellicle::parallel {

/// The owned values of a field as a PETSc vector, (components x items) item after item, without a copy: writing to one
/// changes the other. The field must outlive the vector, and its ghosts must be updated after the vector was written
/// to. Collective.
inline VecHandle vec_of(const Layout& layout, Field& field) {
  VecHandle vec;
  check(VecCreateMPIWithArray(layout.comm, field.components(), field.components() * layout.owned, PETSC_DETERMINE,
                              field.data(), vec.create()));
  return vec;
}

}  // namespace pellicle::parallel
