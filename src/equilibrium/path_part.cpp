#include "equilibrium/path_part.h"

#include <cmath>
#include <numeric>
#include <utility>

#include "parallel/collective.h"

namespace pellicle::equilibrium {

PathPart::PathPart(StepPart& part, std::function<void(double)> set_time, const Pins& pins,
                   const std::vector<double>& mass, double arc_length)
    : ExtendedPart(part),
      set_time_(std::move(set_time)),
      pins_(pins),
      mass_(mass),
      arc_length_(arc_length),
      direction_(part.vertices(), 3),
      position_(part.vertices(), 3) {
  total_mass_ = sum_over_ranks(vertices().comm, std::accumulate(mass.begin(), mass.begin() + vertices().owned, 0.0));
}

void PathPart::begin_step(double time, double h, const Field& direction) {
  time_ = time;
  h_ = h;
  direction_.values() = direction.values();
  if (sum_over_ranks(vertices().comm, direction_.values().squaredNorm()) > 0) {
    return;
  }
  const Eigen::VectorXd load = load_rate();
  for (PetscInt i = 0; i < vertices().owned; ++i) {
    direction_.vector(i) = -load.segment<3>(3 * i) / mass_[i];
  }
  direction_.update_ghosts();
  set_unit_length(direction_);
}

/// Scales a direction to the root mean square 1, unless it is 0. Collective.
void PathPart::set_unit_length(Field& direction) const {
  double square = 0;
  for (PetscInt i = 0; i < vertices().owned; ++i) {
    square += mass_[i] / total_mass_ * direction.vector(i).squaredNorm();
  }
  square = sum_over_ranks(vertices().comm, square);
  if (square > 0) {
    direction.values() /= std::sqrt(square);
  }
}

void PathPart::write_direction(const Field& position, Field& direction) const {
  for (PetscInt i = 0; i < position.values().cols(); ++i) {
    direction.vector(i) = projectors()[i] * Eigen::Vector3d(position.vector(i) - start().vector(i));
  }
  set_unit_length(direction);
}

Eigen::VectorXd PathPart::own_rows() const {
  double along_path = 0;
  for (PetscInt i = 0; i < vertices().owned; ++i) {
    along_path += mass_[i] / total_mass_ * direction_.vector(i).dot(position().vector(i) - start().vector(i));
  }
  along_path = sum_over_ranks(vertices().comm, along_path);
  return Eigen::VectorXd::Constant(1, force_scale() / length_scale() * (along_path - arc_length_ * h_));
}

bool PathPart::move_to(const Field& position, const Eigen::VectorXd& own) {
  if (std::exchange(time_, own[0]) != own[0]) {
    set_time_(time_);
  }
  position_.values() = position.values();
  pins_.impose(position_, time_);
  return part_.move_to(position_, {});
}

Eigen::VectorXd PathPart::load_rate() {
  Field here(vertices(), 3);
  here.values() = position().values();
  const double time = time_;
  const double step = 1e-5 * h_;
  const auto gradient_at = [&](double at) {
    move_to(here, Eigen::VectorXd::Constant(1, at));
    return Eigen::Matrix3Xd(gradient());
  };
  const Eigen::Matrix3Xd before = gradient_at(time);
  const Eigen::Matrix3Xd later = gradient_at(time + step);
  move_to(here, Eigen::VectorXd::Constant(1, time));
  return ((later - before) / step).reshaped();
}

LowRank PathPart::dense_tangent() {
  LowRank result = part_.dense_tangent();
  // The coefficient of the additional column is many times the stiffness along the path, whatever its sign.
  result.coefficients.conservativeResize(columns());
  result.coefficients[columns() - 1] = 10 * part_.stiffness_scale();
  result.mixing = Eigen::MatrixXd::Identity(columns(), columns());
  result.sparse.conservativeResize(3 * vertices().owned, columns());
  for (PetscInt i = 0; i < vertices().owned; ++i) {
    for (int k = 0; k < 3; ++k) {
      result.sparse.insert(3 * i + k, columns() - 1) = mass_[i] / total_mass_ * direction_.vector(i)[k];
    }
  }
  result.sparse.makeCompressed();
  return result;
}

}  // namespace pellicle::equilibrium
