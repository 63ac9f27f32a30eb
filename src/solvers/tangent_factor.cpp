#include "solvers/tangent_factor.h"

#include <algorithm>

#include "base/error.h"
#include "geometry/principal_axes.h"

namespace pellicle {
inline namespace solvers {

namespace {

constexpr PetscInt mumps_scaling_setting = 8;  ///< MUMPS' number of the setting

}  // namespace

TangentFactor::TangentFactor(const Tangent& tangent, const LowRankSystem& system, const std::string& prefix)
    : tangent_(tangent), system_(system), prefix_(prefix) {
  const MPI_Comm comm = tangent_.vertices().comm;
  MPI_Comm_size(comm, &ranks_);
  const int owned = static_cast<int>(tangent_.vertices().owned);
  vertex_counts_.resize(static_cast<std::size_t>(ranks_));
  MPI_Allgather(&owned, 1, MPI_INT, vertex_counts_.data(), 1, MPI_INT, comm);
  check(KSPCreate(comm, solver_.create()));
  check(KSPSetOptionsPrefix(solver_, prefix_.c_str()));
  check(KSPSetOperators(solver_, system_.matrix(), system_.matrix()));
  check(KSPSetType(solver_, KSPCG));
  check(KSPSetNormType(solver_, KSP_NORM_UNPRECONDITIONED));  // saves the last product with the inverse
  PC pc = nullptr;
  check(KSPGetPC(solver_, &pc));
  check(PCSetType(pc, PCSHELL));
  run_solver(prefix_, [&] { check(KSPSetFromOptions(solver_)); });
  check(PCSetType(pc, PCSHELL));  // whatever the options say of the preconditioner in its place
  check(PCShellSetContext(pc, this));
  check(PCShellSetApply(pc, apply_callback));
}

/// The values of all ranks, rank after rank. Collective. @param width number of values for each that is counted
void TangentFactor::gather(const double* own, std::vector<double>& whole, int width,
                           const std::vector<int>& counts) const {
  std::vector<int> sizes;
  std::vector<int> offsets;
  int sum = 0;
  for (const int count : counts) {
    sizes.push_back(width * count);
    offsets.push_back(sum);
    sum += width * count;
  }
  whole.resize(static_cast<std::size_t>(sum));
  int rank = 0;
  MPI_Comm_rank(tangent_.vertices().comm, &rank);
  MPI_Allgatherv(own, sizes[static_cast<std::size_t>(rank)], MPI_DOUBLE, whole.data(), sizes.data(), offsets.data(),
                 MPI_DOUBLE, tangent_.vertices().comm);
}

/// The blocks of the upper half of all ranks' rows, and a matrix and a factor for them.
void TangentFactor::make_pattern() {
  const Layout& reach = tangent_.reach();
  std::vector<double> own;  // rows and columns
  const auto take_place = [&](PetscInt row, PetscInt column, const Eigen::Matrix3d&) {
    if (reach.to_global(column) >= reach.first + row) {
      own.push_back(static_cast<double>(reach.first + row));
      own.push_back(static_cast<double>(reach.to_global(column)));
    }
  };
  TakenBlocks places(reach.owned, take_place);
  tangent_.visit(places);
  const int count = static_cast<int>(own.size() / 2);
  block_counts_.resize(static_cast<std::size_t>(ranks_));
  MPI_Allgather(&count, 1, MPI_INT, block_counts_.data(), 1, MPI_INT, reach.comm);
  std::vector<double> pairs;
  gather(own.data(), pairs, 2, block_counts_);
  rows_.clear();
  columns_.clear();
  std::vector<PetscInt> in_row(static_cast<std::size_t>(reach.global));
  for (std::size_t k = 0; k < pairs.size(); k += 2) {
    rows_.push_back(static_cast<PetscInt>(pairs[k]));
    columns_.push_back(static_cast<PetscInt>(pairs[k + 1]));
    ++in_row[static_cast<std::size_t>(rows_.back())];
  }
  const PetscInt size = 3 * reach.global;
  check(MatCreateSeqSBAIJ(PETSC_COMM_SELF, 3, size, size, 0, in_row.data(), whole_.create()));
  check(MatSetOptionsPrefixFactor(whole_, prefix_.c_str()));
  check(MatSetOption(whole_, MAT_ROW_ORIENTED, PETSC_FALSE));
  check(MatCreateVecs(whole_, right_hand_side_.create(), solution_.create()));
  fill();
  MatFactorInfo info;
  check(MatFactorInfoInitialize(&info));
  check(MatGetFactor(whole_, MATSOLVERMUMPS, MAT_FACTOR_CHOLESKY, factor_.create()));
  check(MatMumpsSetIcntl(factor_, mumps_room_setting, mumps_room));
  check(MatMumpsSetIcntl(factor_, mumps_scaling_setting, 0));  // Rows are alike: scaling costs more than it gains.
  check(MatCholeskyFactorSymbolic(factor_, whole_, nullptr, &info));
}

void TangentFactor::fill() {
  const Layout& reach = tangent_.reach();
  own_blocks_.clear();
  const auto take_block = [&](PetscInt row, PetscInt column, const Eigen::Matrix3d& block) {
    if (reach.to_global(column) >= reach.first + row) {
      own_blocks_.insert(own_blocks_.end(), block.data(), block.data() + block.size());
    }
  };
  TakenBlocks blocks(reach.owned, take_block);
  tangent_.visit(blocks);
  gather(own_blocks_.data(), blocks_, 9, block_counts_);
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    check(MatSetValuesBlocked(whole_, 1, &rows_[k], 1, &columns_[k], blocks_.data() + 9 * k, INSERT_VALUES));
  }
  check(MatAssemblyBegin(whole_, MAT_FINAL_ASSEMBLY));
  check(MatAssemblyEnd(whole_, MAT_FINAL_ASSEMBLY));
}

std::optional<int> TangentFactor::renew() {
  if (factor_ == nullptr) {
    make_pattern();
  } else {
    fill();
  }
  MatFactorInfo info;
  MatFactorError fault = MAT_FACTOR_NOERROR;
  check(MatFactorInfoInitialize(&info));
  check(MatCholeskyFactorNumeric(factor_, whole_, &info));
  check(MatFactorGetError(factor_, &fault));
  influence_.resize(0, 0);
  if (fault != MAT_FACTOR_NOERROR) {
    return std::nullopt;
  }
  PetscInt negative = 0;
  check(MatGetInertia(factor_, &negative, nullptr, nullptr));

  const auto is_held = [this](int column) {
    return std::find(system_.held().begin(), system_.held().end(), column) != system_.held().end();
  };
  std::vector<int> counting;  // columns
  for (int column = 0; column < system_.count(); ++column) {
    if (is_held(column) || system_.low_rank().coefficients[column] != 0) {
      counting.push_back(column);
    }
  }
  const auto count = static_cast<Eigen::Index>(counting.size());
  if (count == 0) {
    return static_cast<int>(negative);
  }
  Eigen::MatrixXd influence(3 * tangent_.vertices().global, count);
  Eigen::MatrixXd border = Eigen::MatrixXd::Zero(count, count);  // C^-1 + G^T T^-1 G
  Eigen::MatrixXd whole_columns(influence.rows(), count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const int column = counting[static_cast<std::size_t>(k)];
    std::vector<double> whole;
    double* values = nullptr;
    const Eigen::VectorXd own = system_.low_rank().column(column);
    gather(own.data(), whole, 3, vertex_counts_);
    whole_columns.col(k) = Eigen::Map<const Eigen::VectorXd>(whole.data(), influence.rows());
    check(VecGetArrayWrite(right_hand_side_, &values));
    std::copy(whole.begin(), whole.end(), values);
    check(VecRestoreArrayWrite(right_hand_side_, &values));
    check(MatSolve(factor_, right_hand_side_, solution_));
    const double* solved = nullptr;
    check(VecGetArrayRead(solution_, &solved));
    influence.col(k) = Eigen::Map<const Eigen::VectorXd>(solved, influence.rows());
    check(VecRestoreArrayRead(solution_, &solved));
    border(k, k) = is_held(column) ? 0 : 1 / system_.low_rank().coefficients[column];
    negative -= is_held(column) || system_.low_rank().coefficients[column] > 0 ? 1 : 0;
  }
  border += whole_columns.transpose() * influence;
  border = ((border + border.transpose()) / 2).eval();
  const Eigen::VectorXd eigenvalues = principal_axes(border).values;
  if (!(eigenvalues.cwiseAbs().minCoeff() > 0)) {
    return std::nullopt;
  }
  border_.compute(border);
  influence_ = std::move(influence);
  return static_cast<int>(negative + (eigenvalues.array() > 0).count());
}

void TangentFactor::apply(Vec in, Vec out) {
  const double* given = nullptr;
  double* values = nullptr;
  std::vector<double> whole;
  check(VecGetArrayRead(in, &given));
  gather(given, whole, 3, vertex_counts_);
  check(VecRestoreArrayRead(in, &given));
  const Eigen::Map<const Eigen::VectorXd> right_hand_side(whole.data(), static_cast<Eigen::Index>(whole.size()));
  check(VecGetArrayWrite(right_hand_side_, &values));
  std::copy(whole.begin(), whole.end(), values);
  check(VecRestoreArrayWrite(right_hand_side_, &values));
  check(MatSolve(factor_, right_hand_side_, solution_));
  const PetscInt first = 3 * tangent_.vertices().first;
  const PetscInt rows = 3 * tangent_.vertices().owned;
  check(VecGetArrayRead(solution_, &given));
  check(VecGetArrayWrite(out, &values));
  Eigen::Map<Eigen::VectorXd> result(values, rows);
  result = Eigen::Map<const Eigen::VectorXd>(given + first, rows);
  if (influence_.cols() > 0) {
    const Eigen::VectorXd weights = border_.solve(influence_.transpose() * right_hand_side);
    result -= influence_.middleRows(first, rows) * weights;
  }
  check(VecRestoreArrayWrite(out, &values));
  check(VecRestoreArrayRead(solution_, &given));
}

PetscErrorCode TangentFactor::apply_callback(PC pc, Vec in, Vec out) {
  return as_petsc_callback([&] {
    TangentFactor* self = nullptr;
    check(PCShellGetContext(pc, &self));
    self->apply(in, out);
  });
}

}  // namespace solvers
}  // namespace pellicle
