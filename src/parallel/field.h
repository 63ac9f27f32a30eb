#pragma once

#include <Eigen/Core>

#include "base/handle.h"
#include "parallel/layout.h"

namespace pellicle {

/// `components` doubles on every item of a layout, owned then ghost, seen both as an Eigen matrix (components x local)
/// and as a PETSc vector of the owned part. The layout must outlive it. Its values can be assigned to another field of
/// the same layout and components; otherwise it is move-only.
class Field {
 public:
  Field() = default;
  /// Zeros. Collective.
  Field(const Layout& layout, int components);
  Field(Field&&) = default;
  Field& operator=(Field&&) = default;
  Field(const Field&) = delete;
  /// Copies the values, ghosts included. Not collective. @throws std::logic_error if the sizes differ
  Field& operator=(const Field& other);

  int components() const { return static_cast<int>(values_.rows()); }
  /// All local values, ghosts last, (components x local). Writing to the owned part must be followed by update_ghosts.
  Eigen::MatrixXd& values() { return values_; }
  const Eigen::MatrixXd& values() const { return values_; }
  /// Column of a vector field.
  Eigen::Map<Eigen::Vector3d> vector(PetscInt i) { return Eigen::Map<Eigen::Vector3d>(values_.data() + 3 * i); }
  Eigen::Map<const Eigen::Vector3d> vector(PetscInt i) const {
    return Eigen::Map<const Eigen::Vector3d>(values_.data() + 3 * i);
  }
  double* data() { return values_.data(); }
  const double* data() const { return values_.data(); }

  /// Copies the owners' values to the ghosts. Collective.
  void update_ghosts();
  /// Adds the ghosts' values to the owners' and zeroes the ghosts. Collective.
  void add_ghosts();

 private:
  Eigen::MatrixXd values_;
  VecHandle vec_;  ///< wraps values_
};

}  // namespace pellicle
