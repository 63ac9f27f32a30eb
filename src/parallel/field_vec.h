#pragma once

#include "base/handle.h"
#include "parallel/field.h"
#include "parallel/layout.h"

namespace pellicle {
inline namespace parallel {

/// The owned values of a field as a PETSc vector, (components x items) item after item, without a copy: writing to one
/// changes the other. The field must outlive the vector, and its ghosts must be updated after the vector was written
/// to. Collective.
VecHandle vec_of(const Layout& layout, Field& field);

}  // namespace parallel
}  // namespace pellicle
