#include "parallel/field_vec.h"

#include <petscvec.h>

#include "base/error.h"

namespace pellicle {
inline namespace parallel {

VecHandle vec_of(const Layout& layout, Field& field) {
  VecHandle vec;
  check(VecCreateMPIWithArray(layout.comm, field.components(), field.components() * layout.owned, PETSC_DETERMINE,
                              field.data(), vec.create()));
  return vec;
}

}  // namespace parallel
}  // namespace pellicle
