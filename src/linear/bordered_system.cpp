#include "linear/bordered_system.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <utility>

#include "base/error.h"
#include "linear/shell_operations.h"

namespace pellicle::linear {

Border::Border(LowRankSystem& part, int size) : part_(part), size_(size) {
  const MPI_Comm comm = comm_of(part_.sparse());
  const PetscInt all = static_cast<PetscInt>(rows()) + border_rows();
  check(MatCreateShell(comm, all, all, PETSC_DETERMINE, PETSC_DETERMINE, this, matrix_.create()));
  set_shell_operation<&Border::multiply>(matrix_, MATOP_MULT);
  check(MatCreateVecs(part_.sparse(), part_right_hand_side_.create(), part_solution_.create()));
}

Eigen::VectorXd Border::border_values(Vec vector) const {
  Eigen::VectorXd values(size_);
  values.head(border_rows()) = ConstVecValues{vector}.tail(border_rows());
  MPI_Bcast(values.data(), size_, MPI_DOUBLE, 0, comm_of(matrix()));
  return values;
}

Eigen::VectorXd Border::multiply_part(Vec x) {
  VecValues{part_right_hand_side_} = ConstVecValues{x}.head(rows());
  check(MatMult(part_.sparse(), part_right_hand_side_, part_solution_));
  return part_.column_products({part_right_hand_side_});
}

void Border::join(Vec vector, const Eigen::VectorXd& border) const {
  VecValues values(vector);
  values.head(rows()) = ConstVecValues{part_solution_};
  values.tail(border_rows()) = border.head(border_rows());
}

BorderedSystem::BorderedSystem(LowRankSystem& part, std::vector<int> columns, Eigen::VectorXd scales)
    : Border(part, static_cast<int>(columns.size())), columns_(std::move(columns)), scales_(std::move(scales)) {
  check(VecDuplicate(part_solution_, work_.create()));
  if (!part_.solves_sparse_alone()) {
    part_.hold(columns_);
    return;
  }
  for (int border = 0; border < size_; ++border) {
    check(VecDuplicate(part_solution_, influence_.emplace_back().create()));
  }
}

LinearResult BorderedSystem::solve(Vec right_hand_side, Vec solution) {
  const Eigen::VectorXd wanted = -border_values(right_hand_side).cwiseQuotient(scales_);  // g.x
  VecValues{part_right_hand_side_} = ConstVecValues{right_hand_side}.head(rows());
  const LinearResult result = part_.solves_sparse_alone() ? eliminate(wanted) : solve_orthogonally(wanted);
  if (result.converged) {
    join(solution, scaled_border_.cwiseQuotient(scales_));
  }
  return result;
}

/// With G = Q R, Q orthonormal: x = Q R^-T w + y for g.x = w, and P A P y = P (r - A Q R^-T w). The border follows from
/// the residual of the rows of T, which is a sum of columns.
LinearResult BorderedSystem::solve_orthogonally(const Eigen::VectorXd& wanted) {
  const Eigen::LLT<Eigen::MatrixXd>& products = part_.held_products();
  const Eigen::MatrixXd factor = products.matrixU();  // its diagonal: of each column, what those before leave
  LinearResult result;
  if (products.info() != Eigen::Success ||
      !(factor.diagonal().array() > 1e-7 * factor.colwise().norm().transpose().array()).all()) {
    result.refuse(Solved::no, "what is prescribed depends on no positions, or twice on the same");
    return result;
  }
  const Eigen::VectorXd along = part_.held_basis() * products.matrixL().solve(wanted);
  copy_to(part_solution_, along);
  part_.multiply_whole(part_solution_, work_);
  check(VecAYPX(work_, -1, part_right_hand_side_));
  part_.project(work_);
  part_.project(work_);  // Little may be left, of which rounding's share would be along the columns.
  result = part_.solve(work_, part_solution_);
  if (!result.converged) {
    return result;
  }
  part_.project(part_solution_);
  double curvature = 0;
  check(VecDot(work_, part_solution_, &curvature));
  if (curvature < 0) {
    result.refuse(Solved::concave, "the matrix is not positive definite");
    return result;
  }
  VecValues{part_solution_} += along;
  part_.multiply_whole(part_solution_, work_);
  check(VecAXPY(work_, -1, part_right_hand_side_));
  scaled_border_ = products.matrixU().solve(part_.project(work_));
  scaled_border_ -= part_.low_rank().coefficients(columns_).cwiseProduct(wanted);  // A has the columns, too.
  return result;
}

/// x = a + sum_c b_c s_c z_c with a = A^-1 (r + G C w), b = A^-1 g and g.x = w.
LinearResult BorderedSystem::eliminate(const Eigen::VectorXd& wanted) {
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(part_.count());
  weights(columns_) = part_.low_rank().coefficients(columns_).cwiseProduct(wanted);
  VecValues{part_right_hand_side_} += part_.low_rank().times(weights);
  LinearResult result = part_.solve(part_right_hand_side_, part_solution_);
  for (int border = 0; border < size_ && result.converged; ++border) {
    copy_to(work_, part_.low_rank().column(columns_[border]));
    result.go_on(part_.solve(work_, influence_[border]));
  }
  if (!result.converged) {
    return result;
  }
  std::vector<Vec> vectors(influence_.begin(), influence_.end());
  vectors.push_back(part_solution_);
  const Eigen::MatrixXd system = part_.column_products(vectors)(columns_, Eigen::all);  // g.b, g.a
  scaled_border_ = system.leftCols(size_).partialPivLu().solve(wanted - system.col(size_));
  check(VecMAXPY(part_solution_, size_, scaled_border_.data(), vectors.data()));

  double curvature = 0;
  check(MatMult(part_.matrix(), part_solution_, work_));
  check(VecDot(work_, part_solution_, &curvature));
  if (curvature < 0) {
    result.refuse(Solved::concave, "the matrix is not positive definite");
  }
  return result;
}

void BorderedSystem::multiply(Vec x, Vec y) {
  const Eigen::VectorXd border = border_values(x);
  const Eigen::VectorXd products = multiply_part(x);
  Eigen::VectorXd weights = part_.low_rank().coefficients.cwiseProduct(products);
  weights(columns_) = -scales_.cwiseProduct(border);
  VecValues{part_solution_} += part_.low_rank().times(weights);
  join(y, -scales_.cwiseProduct(products(columns_)));
}

LoadBorder::LoadBorder(LowRankSystem& part) : Border(part, 1), load_(Eigen::VectorXd::Zero(part.rows())) {
  check(VecDuplicate(part_solution_, influence_.create()));
}

LinearResult LoadBorder::solve(Vec right_hand_side, Vec solution) {
  // S g.x = q, so that A x + l z = r + rho g q/S; x = a - z b with b = A^-1 l.
  const double wanted = border_values(right_hand_side)[0] / scale_;
  const Eigen::VectorXd row = part_.low_rank().column(last());
  VecValues{part_right_hand_side_} =
      ConstVecValues{right_hand_side}.head(rows()) + part_.low_rank().coefficients[last()] * wanted * row;
  LinearResult result = part_.solve(part_right_hand_side_, part_solution_);
  if (!result.converged) {
    return result;
  }
  copy_to(part_right_hand_side_, load_);
  if (!result.go_on(part_.solve(part_right_hand_side_, influence_))) {
    return result;
  }
  const Eigen::VectorXd along = part_.column_products({part_solution_, influence_}).row(last());
  const double load = (along[0] - wanted) / along[1];
  if (!std::isfinite(load)) {
    result.refuse(Solved::no, "the loads do not change any more");
    return result;
  }
  check(VecAXPY(part_solution_, -load, influence_));
  join(solution, Eigen::VectorXd::Constant(1, load));
  return result;
}

void LoadBorder::multiply(Vec x, Vec y) {
  const double load = border_values(x)[0];
  const Eigen::VectorXd products = multiply_part(x);
  Eigen::VectorXd weights = part_.low_rank().coefficients.cwiseProduct(products);
  weights[last()] = 0;
  VecValues{part_solution_} += part_.low_rank().times(weights);
  VecValues{part_solution_} += load * load_;
  join(y, Eigen::VectorXd::Constant(1, scale_ * products[last()]));
}

}  // namespace pellicle::linear
