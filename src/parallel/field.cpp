#include "parallel/field.h"

#include <stdexcept>

#include "base/error.h"

namespace pellicle {

Field::Field(const Layout& layout, int components) : values_(Eigen::MatrixXd::Zero(components, layout.local())) {
  check(VecCreateGhostBlockWithArray(layout.comm, components, components * layout.owned, PETSC_DETERMINE,
                                     layout.ghosts(), layout.ghost_global.data(), values_.data(), vec_.create()));
}

Field& Field::operator=(const Field& other) {
  if (values_.rows() != other.values_.rows() || values_.cols() != other.values_.cols()) {
    throw std::logic_error("a field is assigned to one of another size");  // Its vector wraps the memory that it has.
  }
  values_ = other.values_;
  return *this;
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
