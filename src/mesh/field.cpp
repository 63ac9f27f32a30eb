#include "mesh/field.h"

#include "base/error.h"

namespace pellicle {

Field::Field(const Layout& layout, int components) : values_(Eigen::MatrixXd::Zero(components, layout.local())) {
  check(VecCreateGhostBlockWithArray(layout.comm, components, components * layout.owned, PETSC_DETERMINE,
                                     layout.ghosts(), layout.ghost_global.data(), values_.data(), vec_.create()));
}

void Field::update_ghosts() {
  check(VecGhostUpdateBegin(vec_, INSERT_VALUES, SCATTER_FORWARD));
  check(VecGhostUpdateEnd(vec_, INSERT_VALUES, SCATTER_FORWARD));
}

void Field::add_ghosts() {
  check(VecGhostUpdateBegin(vec_, ADD_VALUES, SCATTER_REVERSE));
  check(VecGhostUpdateEnd(vec_, ADD_VALUES, SCATTER_REVERSE));
  PetscInt size = 0;
  check(VecGetLocalSize(vec_, &size));
  const Eigen::Index columns = size / values_.rows();
  values_.rightCols(values_.cols() - columns).setZero();
}

}  // namespace pellicle
