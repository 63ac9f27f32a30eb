#include "parallel/field.h"

#include <stdexcept>

namespace pellicle {
inline namespace parallel {

Field::Field(const Layout& layout, int components)
    : values_(Eigen::MatrixXd::Zero(components, layout.local())),
      type_(MPI_DOUBLE, components),
      exchange_(layout.exchange()) {}

Field& Field::operator=(const Field& other) {
  if (values_.rows() != other.values_.rows() || values_.cols() != other.values_.cols()) {
    throw std::logic_error("a field is assigned to one of another size");
  }
  values_ = other.values_;
  return *this;
}

void Field::update_ghosts() { exchange_->copy(type_, bytes(), data()); }

void Field::add_ghosts() {
  exchange_->combine(type_, bytes(), MPI_SUM, data());
  values_.rightCols(values_.cols() - exchange_->owned()).setZero();
}

}  // namespace parallel
}  // namespace pellicle
