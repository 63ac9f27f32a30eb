#include "linear/low_rank_system.h"

#include <Eigen/LU>
#include <algorithm>
#include <utility>

#include "base/error.h"
#include "linear/shell_operations.h"
#include "parallel/collective.h"

namespace pellicle::linear {

LowRankSystem::LowRankSystem(Mat sparse, int columns, const std::string& prefix, const KspDefaults& defaults)
    : sparse_(sparse), rtol_(defaults.rtol) {
  check(MatGetLocalSize(sparse, &rows_, nullptr));
  low_rank_ = LowRank(Eigen::SparseMatrix<double>(rows_, columns), Eigen::VectorXd::Zero(columns));
  if (columns > 0) {
    matrix_ = symmetric_shell<&LowRankSystem::multiply>(comm_of(sparse), rows_, this);
    check(MatCreateVecs(sparse, projected_.create(), nullptr));
  }
  solver_ = make_ksp(matrix(), sparse, prefix, defaults);
  solves_sparse_alone_ = columns > 0 && has_type(solver(), {KSPPREONLY});
  if (solves_sparse_alone_) {
    check(KSPSetOperators(solver_, sparse, sparse));
  }
}

void LowRankSystem::update(LowRank low_rank) {
  influence_.clear();
  low_rank_ = std::move(low_rank);
  make_basis();
}

void LowRankSystem::make_basis() {
  if (constrained_.empty()) {
    return;
  }
  const Eigen::MatrixXd columns = low_rank_.columns(constrained_);
  Eigen::MatrixXd products = columns.transpose() * columns;
  sum_over_ranks(comm_of(sparse_), products);
  held_products_.compute(products);
  basis_.setZero(rows_, columns.cols());
  if (held_products_.info() == Eigen::Success) {
    basis_ = held_products_.matrixU().solve<Eigen::OnTheRight>(columns);
  }
}

void LowRankSystem::multiply(Vec x, Vec y) {
  if (constrained_.empty()) {
    multiply_whole(x, y);
    return;
  }
  check(VecCopy(x, projected_));
  project(projected_);
  if (static_cast<int>(constrained_.size()) < count()) {
    multiply_whole(projected_, y);
  } else {  // P takes every column out.
    check(MatMult(sparse_, projected_, y));
  }
  project(y);
}

void LowRankSystem::multiply_whole(Vec x, Vec y) const {
  check(MatMult(sparse_, x, y));
  const Eigen::VectorXd weights = low_rank_.coefficients.cwiseProduct(column_products({x}).col(0));
  const Eigen::VectorXd mixed = low_rank_.mixing * weights;
  VecValues{y}.noalias() += low_rank_.sparse * mixed;
}

Eigen::VectorXd LowRankSystem::project(Vec x) const {
  VecValues own(x);
  Eigen::VectorXd components = basis_.transpose() * own;
  sum_over_ranks(comm_of(sparse_), components);
  own.noalias() -= basis_ * components;
  return components;
}

/// The solver, and the smoother of its multigrid, which keeps the operators that it has.
std::vector<KSP> LowRankSystem::solvers() const {
  std::vector<KSP> solvers{solver_};
  const PC pc = preconditioner_of(solver_);
  if (has_type(pc, {PCMG})) {
    PetscInt levels = 0;
    check(PCMGGetLevels(pc, &levels));
    check(PCMGGetSmoother(pc, levels - 1, &solvers.emplace_back()));
  }
  return solvers;
}

void LowRankSystem::precondition_from(Mat matrix) {
  Mat system = nullptr;
  check(KSPGetOperators(solver_, &system, nullptr));
  for (KSP solver : solvers()) {
    check(KSPSetOperators(solver, system, matrix));
  }
}

void LowRankSystem::forget_pattern() {
  // PETSc makes a preconditioner's pattern anew where the matrix's count of patterns has grown, and the count of a new
  // matrix need not be larger than that of the former one. With another matrix in between PETSc forgets the count.
  MatHandle other;
  check(MatCreateShell(comm_of(sparse_), rows_, rows_, PETSC_DETERMINE, PETSC_DETERMINE, nullptr, other.create()));
  for (KSP solver : solvers()) {
    Mat system = nullptr;
    check(KSPGetOperators(solver, &system, nullptr));
    if (system != nullptr) {  // of a smoother after its first use
      check(KSPSetOperators(solver, system, other));
      check(KSPSetOperators(solver, system, sparse_));
    }
  }
}

LinearResult LowRankSystem::solve(Vec right_hand_side, Vec solution, const LinearNeed* need) {
  if (solves_sparse_alone_ && other_solver_ == nullptr) {
    return solve_by_woodbury(right_hand_side, solution);
  }
  return pellicle::solve(other_solver_ != nullptr ? other_solver_ : solver_, right_hand_side, solution, need);
}

/// With Z = T^-1 G: A^-1 r = T^-1 r - Z (1 + C G^T Z)^-1 C G^T T^-1 r.
LinearResult LowRankSystem::solve_by_woodbury(Vec right_hand_side, Vec solution) {
  LinearResult result;
  while (static_cast<int>(influence_.size()) < count()) {
    VecHandle influence;
    VecHandle column;
    check(VecDuplicate(right_hand_side, influence.create()));
    check(VecDuplicate(right_hand_side, column.create()));
    copy_to(column, low_rank_.column(static_cast<Eigen::Index>(influence_.size())));
    if (!result.go_on(pellicle::solve(solver_, column, influence))) {
      return result;
    }
    influence_.push_back(std::move(influence));
  }
  if (!result.go_on(pellicle::solve(solver_, right_hand_side, solution))) {
    return result;
  }
  std::vector<Vec> vectors(influence_.begin(), influence_.end());
  vectors.push_back(solution);
  const Eigen::MatrixXd scaled = low_rank_.coefficients.asDiagonal() * column_products(vectors);
  const Eigen::MatrixXd system = Eigen::MatrixXd::Identity(count(), count()) + scaled.leftCols(count());
  const Eigen::VectorXd weights = -system.partialPivLu().solve(scaled.col(count()));
  check(VecMAXPY(solution, count(), weights.data(), vectors.data()));
  const std::string fault = fault_of_solution(matrix_, sparse_, right_hand_side, solution, {rtol_});
  if (!fault.empty()) {
    result.refuse(Solved::no,
                  "the linear solver " + prefix_of(solver_) + " with the low-rank part does not solve: " + fault);
  }
  return result;
}

Eigen::MatrixXd LowRankSystem::column_products(const std::vector<Vec>& vectors) const {
  Eigen::MatrixXd products(count(), vectors.size());
  for (std::size_t column = 0; column < vectors.size(); ++column) {
    products.col(static_cast<Eigen::Index>(column)) = low_rank_.transposed_times(ConstVecValues{vectors[column]});
  }
  sum_over_ranks(comm_of(sparse_), products);
  return products;
}

}  // namespace pellicle::linear
