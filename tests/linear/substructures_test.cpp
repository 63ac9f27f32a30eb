// Inverse of matrices that ranks share, against dense ones.

#include "linear/substructures.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "base/error.h"
#include "base/handle.h"
#include "tests/linear/chain_matrix.h"

namespace pellicle {
namespace {

/// A matrix of unknowns in a grid of columns, each coupled with its neighbours, and of some that nothing is coupled
/// with.
struct Grid {
  PetscInt width = 9;
  PetscInt height = 7;
  PetscInt alone = 3;
  bool diagonals = false;
  double shift = 0.1;

  PetscInt size() const { return width * height + alone; }
  double entry(PetscInt row, PetscInt column) const {
    if (row == column) {
      return 5 + shift + 0.01 * static_cast<double>(row);
    }
    if (std::max(row, column) >= width * height) {
      return 0;
    }
    const PetscInt across = std::abs(row % width - column % width);
    const PetscInt along = std::abs(row / width - column / width);
    if (across + along == 1) {
      return -1 - 0.1 * std::sin(static_cast<double>(row + column));
    }
    return diagonals && across == 1 && along == 1 ? 0.25 : 0;
  }
  Eigen::MatrixXd dense() const {
    return Eigen::MatrixXd::NullaryExpr(size(), size(), [this](Eigen::Index i, Eigen::Index j) { return entry(i, j); });
  }
};

/// @param fractions of the rows that ranks 0, 1 ... get, in any unit
MatHandle matrix_of(const Grid& grid, const std::array<int, 4>& shares = {1, 1, 1, 1}) {
  int rank = 0;
  int ranks = 1;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
  std::vector<int> starts = {0};
  for (int r = 0; r < ranks; ++r) {
    starts.push_back(starts.back() + shares[static_cast<std::size_t>(r) % 4]);
  }
  const PetscInt first = grid.size() * starts[rank] / starts.back();
  const PetscInt end = grid.size() * starts[static_cast<std::size_t>(rank) + 1] / starts.back();
  MatHandle matrix;
  check(MatCreateAIJ(PETSC_COMM_WORLD, end - first, end - first, grid.size(), grid.size(), 9, nullptr, 9, nullptr,
                     matrix.create()));
  for (PetscInt i = first; i < end; ++i) {
    for (PetscInt j = 0; j < grid.size(); ++j) {
      const double value = grid.entry(i, j);
      if (value != 0) {
        check(MatSetValue(matrix, i, j, value, INSERT_VALUES));
      }
    }
  }
  check(MatAssemblyBegin(matrix, MAT_FINAL_ASSEMBLY));
  check(MatAssemblyEnd(matrix, MAT_FINAL_ASSEMBLY));
  return matrix;
}

/// Largest deviation of what is made of a right-hand side from what the dense inverse makes of it.
double deviation(Substructures& inverse, Mat matrix, const Eigen::MatrixXd& dense) {
  VecHandle in;
  VecHandle out;
  check(MatCreateVecs(matrix, in.create(), out.create()));
  PetscInt first = 0;
  PetscInt end = 0;
  double* values = nullptr;
  check(VecGetOwnershipRange(in, &first, &end));
  check(VecGetArray(in, &values));
  Eigen::VectorXd load(dense.rows());
  for (PetscInt i = 0; i < load.size(); ++i) {
    load[i] = std::cos(0.7 * static_cast<double>(i));
  }
  std::copy(load.begin() + first, load.begin() + end, values);
  check(VecRestoreArray(in, &values));
  inverse.solve(in, out);
  const Eigen::VectorXd wanted = dense.lu().solve(load);
  const double* solved = nullptr;
  double result = 0;
  check(VecGetArrayRead(out, &solved));
  for (PetscInt i = first; i < end; ++i) {
    result = std::max(result, std::abs(solved[i - first] - wanted[i]));
  }
  check(VecRestoreArrayRead(out, &solved));
  MPI_Allreduce(MPI_IN_PLACE, &result, 1, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD);
  return result;
}

TEST(Substructures, AreTheInverseHoweverTheRowsAreSharedOut) {
  const Grid grid;
  int ranks = 1;
  MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
  for (const std::array<int, 4>& shares : {std::array<int, 4>{1, 1, 1, 1}, {1, 0, 2, 1}, {0, 1, 3, 0}, {1, 60, 1, 1}}) {
    if (ranks == 1 && shares[0] == 0) {
      continue;  // Nobody would have a row.
    }
    const MatHandle matrix = matrix_of(grid, shares);
    Substructures inverse;
    ASSERT_TRUE(inverse.refresh(matrix));
    EXPECT_LT(deviation(inverse, matrix, grid.dense()), 1e-13);
  }
}

TEST(Substructures, TakeNewValuesAndANewPattern) {
  Grid grid;
  Substructures inverse;
  ASSERT_TRUE(inverse.refresh(matrix_of(grid)));
  grid.shift = 3;
  ASSERT_TRUE(inverse.refresh(matrix_of(grid)));
  const MatHandle shifted = matrix_of(grid);
  EXPECT_LT(deviation(inverse, shifted, grid.dense()), 1e-13);
  grid.diagonals = true;
  const MatHandle denser = matrix_of(grid);
  inverse.forget_pattern();
  ASSERT_TRUE(inverse.refresh(denser));
  EXPECT_LT(deviation(inverse, denser, grid.dense()), 1e-13);
}

TEST(Substructures, TellOnEveryRankThatAMatrixIsNotPositiveDefinite) {
  Grid grid;
  grid.shift = -6;  // without what other ranks have, too
  Substructures inverse;
  EXPECT_FALSE(inverse.refresh(matrix_of(grid)));

  // On two ranks: 2 > 2.4 cos(pi / 5), so that what either rank has is positive definite, but 2 < 2.4 cos(pi / 7).
  inverse.forget_pattern();
  const MatHandle chain = chain_matrix(6, -1.2);
  EXPECT_FALSE(inverse.refresh(chain));

  // Which a solver hears, too.
  KspHandle solver;
  PC pc = nullptr;
  VecHandle in;
  VecHandle out;
  KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
  check(MatCreateVecs(chain, in.create(), out.create()));
  check(VecSet(in, 1));
  check(KSPCreate(PETSC_COMM_WORLD, solver.create()));
  check(KSPSetOperators(solver, chain, chain));
  check(KSPGetPC(solver, &pc));
  inverse.precondition(pc);
  check(KSPSolve(solver, in, out));
  check(KSPGetConvergedReason(solver, &reason));
  EXPECT_EQ(reason, KSP_DIVERGED_PC_FAILED);
}

}  // namespace
}  // namespace pellicle
