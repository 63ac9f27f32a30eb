#include "linear/load_border.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "linear/shell_operations.h"

namespace pellicle {
inline namespace linear {

namespace {

/// Writes values to the owned rows of a vector.
void fill(Vec vector, const Eigen::VectorXd& values) {
  double* entries = nullptr;
  check(VecGetArrayWrite(vector, &entries));
  std::copy(values.begin(), values.end(), entries);
  check(VecRestoreArrayWrite(vector, &entries));
}

/// The first rows of a vector.
Eigen::VectorXd head_of(Vec vector, Eigen::Index rows) {
  const double* entries = nullptr;
  check(VecGetArrayRead(vector, &entries));
  const Eigen::VectorXd values = Eigen::Map<const Eigen::VectorXd>(entries, rows);
  check(VecRestoreArrayRead(vector, &entries));
  return values;
}

}  // namespace

LoadBorder::LoadBorder(LowRankSystem& part) : part_(part), load_(Eigen::VectorXd::Zero(part.rows())) {
  const MPI_Comm comm = PetscObjectComm(reinterpret_cast<PetscObject>(part_.sparse()));
  MPI_Comm_rank(comm, &rank_);
  const PetscInt size = static_cast<PetscInt>(rows()) + border_rows();
  check(MatCreateShell(comm, size, size, PETSC_DETERMINE, PETSC_DETERMINE, this, matrix_.create()));
  set_shell_operation<&LoadBorder::multiply>(matrix_, MATOP_MULT);
  check(MatCreateVecs(part_.sparse(), part_right_hand_side_.create(), part_solution_.create()));
  check(VecDuplicate(part_solution_, influence_.create()));
}

void LoadBorder::update(const Eigen::VectorXd& load, double scale) {
  load_ = load;
  scale_ = scale;
}

LinearResult LoadBorder::solve(Vec right_hand_side, Vec solution) {
  // S g.x = q, so that A x + l z = r + rho g q/S; x = a - z b with b = A^-1 l.
  const double wanted = border_value(right_hand_side) / scale_;
  const Eigen::VectorXd row = part_.low_rank().column(last());
  fill(part_right_hand_side_, head_of(right_hand_side, rows()) + part_.low_rank().coefficients[last()] * wanted * row);
  LinearResult result = part_.solve(part_right_hand_side_, part_solution_);
  if (!result.converged) {
    return result;
  }
  const int iterations = result.iterations;
  fill(part_right_hand_side_, load_);
  result = part_.solve(part_right_hand_side_, influence_);
  result.iterations += iterations;
  if (!result.converged) {
    return result;
  }
  const Eigen::VectorXd along = part_.column_products({part_solution_, influence_}).row(last());
  const double load = (along[0] - wanted) / along[1];
  if (!std::isfinite(load)) {
    result.refuse(Solved::no, "the loads do not change any more");
    return result;
  }
  check(VecAXPY(part_solution_, -load, influence_));
  const Eigen::VectorXd x = head_of(part_solution_, rows());
  double* values = nullptr;
  check(VecGetArrayWrite(solution, &values));
  std::copy(x.begin(), x.end(), values);
  if (rank_ == 0) {
    values[rows()] = load;
  }
  check(VecRestoreArrayWrite(solution, &values));
  return result;
}

double LoadBorder::border_value(Vec vector) const {
  const double* given = nullptr;
  check(VecGetArrayRead(vector, &given));
  double value = rank_ == 0 ? given[rows()] : 0;
  check(VecRestoreArrayRead(vector, &given));
  MPI_Bcast(&value, 1, MPI_DOUBLE, 0, PetscObjectComm(reinterpret_cast<PetscObject>(Mat(matrix_))));
  return value;
}

void LoadBorder::multiply(Vec x, Vec y) {
  const double load = border_value(x);
  fill(part_right_hand_side_, head_of(x, rows()));
  check(MatMult(part_.sparse(), part_right_hand_side_, part_solution_));
  const Eigen::VectorXd products = part_.column_products({part_right_hand_side_});
  Eigen::VectorXd weights = part_.low_rank().coefficients.cwiseProduct(products);
  weights[last()] = 0;
  const Eigen::VectorXd result = head_of(part_solution_, rows()) + part_.low_rank().times(weights) + load * load_;
  double* values = nullptr;
  check(VecGetArrayWrite(y, &values));
  std::copy(result.begin(), result.end(), values);
  if (rank_ == 0) {
    values[rows()] = scale_ * products[last()];
  }
  check(VecRestoreArrayWrite(y, &values));
}

}  // namespace linear
}  // namespace pellicle
