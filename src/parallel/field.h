#pragma once

#include <Eigen/Core>
#include <memory>
#include <stdexcept>

#include "base/error.h"
#include "base/handle.h"
#include "parallel/exchange.h"
#include "parallel/layout.h"

namespace pellicle::parallel {

/// A distributed field: `components` doubles on every item of a layout, owned items before ghosts. Move-only, except
/// that values can be assigned to a field of the same layout and components.
class Field {
 public:
  /// A view of all local values, ghosts last, (components x local); it cannot change their number.
  using Values = Eigen::Map<Eigen::MatrixXd, Eigen::AlignedMax>;
  using ConstValues = Eigen::Map<const Eigen::MatrixXd, Eigen::AlignedMax>;

  Field() = default;
  /// A field of zeros. Collective.
  Field(const Layout& layout, int components)
      : values_(Eigen::MatrixXd::Zero(components, layout.local())),
        type_(MPI_DOUBLE, components),
        exchange_(layout.exchange()) {}
  Field(Field&&) = default;
  Field& operator=(Field&&) = default;
  Field(const Field&) = delete;
  /// Copies the values, ghosts included. Not collective. @throws std::logic_error if the sizes differ
  Field& operator=(const Field& other) {
    if (values_.rows() != other.values_.rows() || values_.cols() != other.values_.cols()) {
      throw std::logic_error("a field is assigned to one of another size");
    }
    values_ = other.values_;
    return *this;
  }

  int components() const { return static_cast<int>(values_.rows()); }
  /// The values; writing to the owned part must be followed by update_ghosts.
  Values values() { return {values_.data(), values_.rows(), values_.cols()}; }
  ConstValues values() const { return {values_.data(), values_.rows(), values_.cols()}; }
  /// Value of a vector field at an item.
  Eigen::Map<Eigen::Vector3d> vector(PetscInt i) { return Eigen::Map<Eigen::Vector3d>(values_.data() + 3 * i); }
  Eigen::Map<const Eigen::Vector3d> vector(PetscInt i) const {
    return Eigen::Map<const Eigen::Vector3d>(values_.data() + 3 * i);
  }
  double* data() { return values_.data(); }
  const double* data() const { return values_.data(); }

  /// Copies the owners' values to the ghosts. Collective.
  void update_ghosts() { exchange_->copy(type_, bytes(), data()); }
  /// Adds the ghosts' values to the owners' and sets the ghosts to 0. Collective.
  void add_ghosts() {
    exchange_->combine(type_, bytes(), MPI_SUM, data());
    values_.rightCols(values_.cols() - exchange_->owned()).setZero();
  }

 private:
  std::size_t bytes() const { return static_cast<std::size_t>(values_.rows()) * sizeof(double); }

  Eigen::MatrixXd values_;
  RowType type_;  ///< of one item's values
  std::shared_ptr<const GhostExchange> exchange_;
};

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
