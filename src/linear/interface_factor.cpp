#include "linear/interface_factor.h"

#include <petscblaslapack.h>
#include <petscsys.h>

#include <algorithm>
#include <utility>

#include "base/error.h"

namespace pellicle::linear {

InterfaceFactor::InterfaceFactor(std::vector<int> rows, std::vector<int> columns, int size, const std::string& prefix) {
  const std::size_t order = size;
  if (rows.size() < order * (order + 1) / 2) {
    sparse_ = std::make_unique<MumpsFactor>(std::move(rows), std::move(columns), size, 0, prefix);
    return;
  }
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const auto [first, second] = std::minmax(rows[k], columns[k]);
    place_.push_back(static_cast<std::size_t>(first - 1) * order + static_cast<std::size_t>(second - 1));
  }
  values_.resize(rows.size());
  matrix_.resize(size, size);
  pivots_.resize(order);
  constexpr std::size_t block = 64;  // columns that LAPACK eliminates at once
  workspace_.resize(block * order);
}

bool InterfaceFactor::refresh() {
  if (sparse_) {
    return sparse_->refresh();
  }
  matrix_.setZero();
  for (std::size_t k = 0; k < place_.size(); ++k) {
    matrix_.data()[place_[k]] += values_[k];
  }
  const auto order = static_cast<PetscBLASInt>(matrix_.rows());
  const auto clearance = static_cast<PetscBLASInt>(workspace_.size());
  PetscBLASInt zero_pivot = 0;
  if (order > 0) {
    LAPACKsytrf_("L", &order, matrix_.data(), &order, pivots_.data(), workspace_.data(), &clearance, &zero_pivot);
    check(PetscLogFlops(static_cast<double>(order) * order * order / 3));
  }
  return zero_pivot == 0;
}

int InterfaceFactor::negative() const {
  if (sparse_) {
    return sparse_->negative();
  }
  int twice = 0;
  for (Eigen::Index row = 0; row < matrix_.rows(); ++row) {
    const bool is_of_two = pivots_[row] < 0;  // A pivot of two rows has one negative and one positive eigenvalue.
    twice += is_of_two ? 1 : matrix_(row, row) < 0 ? 2 : 0;
  }
  return twice / 2;
}

void InterfaceFactor::solve(Eigen::VectorXd& values) {
  if (sparse_) {
    sparse_->expand(values);
    return;
  }
  const auto order = static_cast<PetscBLASInt>(matrix_.rows());
  const PetscBLASInt one = 1;
  PetscBLASInt info = 0;
  if (order > 0) {
    LAPACKsytrs_("L", &order, &one, matrix_.data(), &order, pivots_.data(), values.data(), &order, &info);
  }
}

}  // namespace pellicle::linear
