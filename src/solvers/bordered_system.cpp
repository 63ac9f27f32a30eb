#include "solvers/bordered_system.h"

#include <Eigen/LU>
#include <algorithm>
#include <utility>

#include "base/error.h"
#include "solvers/shell_operations.h"

namespace pellicle {
inline namespace solvers {

BorderedSystem::BorderedSystem(LowRankSystem& part, std::vector<int> columns, Eigen::VectorXd scales)
    : part_(part), columns_(std::move(columns)), scales_(std::move(scales)) {
  const MPI_Comm comm = PetscObjectComm(reinterpret_cast<PetscObject>(part_.sparse()));
  MPI_Comm_rank(comm, &rank_);
  const PetscInt rows = static_cast<PetscInt>(part_.rows()) + (rank_ == 0 ? size() : 0);
  check(MatCreateShell(comm, rows, rows, PETSC_DETERMINE, PETSC_DETERMINE, this, matrix_.create()));
  set_shell_operation<&BorderedSystem::multiply>(matrix_, MATOP_MULT);
  check(MatCreateVecs(part_.sparse(), part_right_hand_side_.create(), part_solution_.create()));
  for (int border = 0; border < size(); ++border) {
    check(VecDuplicate(part_solution_, influence_.emplace_back().create()));
  }
}

LinearResult BorderedSystem::solve(Vec right_hand_side, Vec solution) {
  const LowRank& low_rank = part_.low_rank();
  const Eigen::Index rows = part_.rows();
  const Eigen::VectorXd border_rows = border_values(right_hand_side);
  const auto as_vector = [rows](double* values) { return Eigen::Map<Eigen::VectorXd>(values, rows); };

  double* values = nullptr;
  const double* given = nullptr;
  check(VecGetArrayRead(right_hand_side, &given));
  check(VecGetArray(part_right_hand_side_, &values));
  as_vector(values) = Eigen::Map<const Eigen::VectorXd>(given, rows);
  for (int border = 0; border < size(); ++border) {
    const int column = columns_[static_cast<std::size_t>(border)];
    as_vector(values) -=
        low_rank.coefficients[column] * border_rows[border] / scales_[border] * low_rank.column(column);
  }
  check(VecRestoreArray(part_right_hand_side_, &values));
  check(VecRestoreArrayRead(right_hand_side, &given));
  LinearResult result = part_.solve(part_right_hand_side_, part_solution_);
  for (int border = 0; border < size() && result.converged; ++border) {
    check(VecGetArray(part_right_hand_side_, &values));
    as_vector(values) = low_rank.column(columns_[static_cast<std::size_t>(border)]);
    check(VecRestoreArray(part_right_hand_side_, &values));
    const int iterations = result.iterations;
    result = part_.solve(part_right_hand_side_, influence_[static_cast<std::size_t>(border)]);
    result.iterations += iterations;
  }
  if (!result.converged) {
    return result;
  }

  // x = a + sum_c b_c s_c z_c with a = A^-1 r, b = A^-1 g and s_d g_d.x = -q_d.
  std::vector<Vec> vectors(influence_.begin(), influence_.end());
  vectors.push_back(part_solution_);
  const Eigen::MatrixXd system = part_.column_products(vectors)(columns_, Eigen::all);  // g.b, g.a
  const Eigen::VectorXd wanted = -border_rows.cwiseQuotient(scales_) - system.col(size());
  const Eigen::VectorXd scaled_border = system.leftCols(size()).partialPivLu().solve(wanted);  // s z
  check(VecMAXPY(part_solution_, size(), scaled_border.data(), vectors.data()));

  double curvature = 0;
  check(MatMult(part_.matrix(), part_solution_, part_right_hand_side_));
  check(VecDot(part_right_hand_side_, part_solution_, &curvature));
  check(VecGetArrayRead(part_solution_, &given));
  check(VecGetArray(solution, &values));
  std::copy_n(given, rows, values);
  for (int border = 0; rank_ == 0 && border < size(); ++border) {
    values[rows + border] = scaled_border[border] / scales_[border];
  }
  check(VecRestoreArray(solution, &values));
  check(VecRestoreArrayRead(part_solution_, &given));
  if (curvature < 0) {
    result.refuse(Solved::concave, "the matrix is not positive definite");
  }
  return result;
}

Eigen::VectorXd BorderedSystem::border_values(Vec vector) const {
  Eigen::VectorXd values(size());
  const double* given = nullptr;
  check(VecGetArrayRead(vector, &given));
  if (rank_ == 0) {
    std::copy_n(given + part_.rows(), size(), values.data());
  }
  check(VecRestoreArrayRead(vector, &given));
  MPI_Bcast(values.data(), size(), MPI_DOUBLE, 0, PetscObjectComm(reinterpret_cast<PetscObject>(Mat(matrix_))));
  return values;
}

void BorderedSystem::multiply(Vec x, Vec y) {
  const LowRank& low_rank = part_.low_rank();
  const Eigen::Index rows = part_.rows();
  const Eigen::VectorXd border = border_values(x);
  const double* given = nullptr;
  double* values = nullptr;
  check(VecGetArrayRead(x, &given));
  check(VecGetArray(part_right_hand_side_, &values));
  std::copy_n(given, rows, values);
  check(VecRestoreArray(part_right_hand_side_, &values));
  check(VecRestoreArrayRead(x, &given));
  check(MatMult(part_.sparse(), part_right_hand_side_, part_solution_));
  const Eigen::VectorXd products = part_.column_products({part_right_hand_side_});
  Eigen::VectorXd weights = low_rank.coefficients.cwiseProduct(products);
  for (int b = 0; b < size(); ++b) {
    weights[columns_[static_cast<std::size_t>(b)]] = -scales_[b] * border[b];
  }
  check(VecGetArrayRead(part_solution_, &given));
  check(VecGetArray(y, &values));
  Eigen::Map<Eigen::VectorXd>(values, rows) = Eigen::Map<const Eigen::VectorXd>(given, rows) + low_rank.times(weights);
  for (int b = 0; rank_ == 0 && b < size(); ++b) {
    values[rows + b] = -scales_[b] * products[columns_[static_cast<std::size_t>(b)]];
  }
  check(VecRestoreArray(y, &values));
  check(VecRestoreArrayRead(part_solution_, &given));
}

}  // namespace solvers
}  // namespace pellicle
