#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <csignal>
#include <vector>

#include "base/stop_signal.h"
#include "geometry/principal_axes.h"
#include "linear/bordered_system.h"
#include "linear/newton.h"
#include "tests/linear/chain_matrix.h"
#include "tests/support/solver_options.h"

namespace pellicle {
namespace {

constexpr PetscInt size = 30;

/// Two columns and a right-hand side, the same on every rank.
Eigen::MatrixXd some_columns() {
  Eigen::MatrixXd columns(size, 2);
  for (Eigen::Index i = 0; i < size; ++i) {
    const double at = static_cast<double>(i);
    columns.row(i) << std::cos(0.3 * at), 0.1 * at - 1;
  }
  return columns;
}

Eigen::VectorXd some_values(Eigen::Index count) {
  Eigen::VectorXd values(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    values[i] = std::sin(1.0 + static_cast<double>(i * i));
  }
  return values;
}

/// A system T + G C G^T with T the chain, and the rows of this rank.
struct System {
  System(const Eigen::Vector2d& coefficients, double beside)
      : matrix(chain_matrix(size, beside)), system(matrix, 2, "test_", {KSPCG, PCJACOBI, 1e-12}) {
    check(MatGetOwnershipRange(matrix, &first, &end));
    system.update({some_columns().middleRows(first, end - first).sparseView(), coefficients});
    dense = dense_chain(size, beside) + some_columns() * coefficients.asDiagonal() * some_columns().transpose();
  }

  /// @param values of all rows @param border rows at the end of rank 0's, the last of `values`
  void set(Vec vector, const Eigen::VectorXd& values, Eigen::Index border = 0) const {
    double* array = nullptr;
    check(VecGetArray(vector, &array));
    Eigen::Map<Eigen::VectorXd>(array, end - first) = values.segment(first, end - first);
    if (rank() == 0) {
      Eigen::Map<Eigen::VectorXd>(array + (end - first), border) = values.tail(border);
    }
    check(VecRestoreArray(vector, &array));
  }

  /// Largest difference of this rank's rows.
  double difference(Vec vector, const Eigen::VectorXd& expected, Eigen::Index border = 0) const {
    const double* array = nullptr;
    check(VecGetArrayRead(vector, &array));
    double largest = (Eigen::Map<const Eigen::VectorXd>(array, end - first) - expected.segment(first, end - first))
                         .cwiseAbs()
                         .maxCoeff();
    if (rank() == 0 && border > 0) {
      const Eigen::Map<const Eigen::VectorXd> own(array + (end - first), border);
      largest = std::max(largest, (own - expected.tail(border)).cwiseAbs().maxCoeff());
    }
    check(VecRestoreArrayRead(vector, &array));
    return largest;
  }

  static int rank() {
    int rank = 0;
    MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
    return rank;
  }

  MatHandle matrix;
  LowRankSystem system;
  PetscInt first = 0;
  PetscInt end = 0;
  Eigen::MatrixXd dense;
};

TEST(LowRankSystem, ConjugateGradientsAndADirectSolverSolveIt) {
  for (const bool is_direct : {false, true}) {
    SolverOptions options;
    if (is_direct) {
      options.set("test_ksp_type", "preonly");
      options.set("test_pc_type", "lu");
      options.set("test_pc_factor_mat_solver_type", "mumps");
    }
    System given({0.5, 2}, -1);
    LowRankSystem& system = given.system;
    EXPECT_EQ(system.solves_sparse_alone(), is_direct);
    VecHandle x;
    VecHandle b;
    check(MatCreateVecs(given.matrix, x.create(), b.create()));
    const Eigen::VectorXd values = some_values(size);
    given.set(b, values);
    for (int time = 0; time < 2; ++time) {  // the second knows the columns' influence
      const LinearResult result = system.solve(b, x);
      EXPECT_TRUE(result.converged) << result.reason;
      EXPECT_EQ(result.iterations, is_direct ? (time == 0 ? 3 : 1) : result.iterations);
      EXPECT_LT(given.difference(x, given.dense.partialPivLu().solve(values)), 1e-9);
    }
  }
}

TEST(LowRankSystem, ColumnsCanBeMixed) {
  System given({0.5, 2}, -1);
  LowRank low_rank(some_columns().middleRows(given.first, given.end - given.first).sparseView(),
                   Eigen::Vector2d(0.5, 2));
  low_rank.mixing = Eigen::Rotation2Dd(0.7).toRotationMatrix();
  const Eigen::MatrixXd columns = some_columns() * low_rank.mixing;
  const Eigen::MatrixXd dense =
      dense_chain(size, -1) + columns * low_rank.coefficients.asDiagonal() * columns.transpose();
  given.system.update(low_rank);
  VecHandle x;
  VecHandle b;
  check(MatCreateVecs(given.matrix, x.create(), b.create()));
  given.set(b, some_values(size));
  check(MatMult(given.system.matrix(), b, x));
  EXPECT_LT(given.difference(x, dense * some_values(size)), 1e-13);
  EXPECT_TRUE(given.system.solve(b, x).converged);
  EXPECT_LT(given.difference(x, dense.partialPivLu().solve(some_values(size))), 1e-9);
}

TEST(LowRankSystem, AMatrixWithANegativeDirectionIsConcave) {
  System given({0.5, 2}, -2);
  VecHandle x;
  VecHandle b;
  check(MatCreateVecs(given.matrix, x.create(), b.create()));
  given.set(b, some_values(size));
  const LinearResult result = given.system.solve(b, x);
  EXPECT_FALSE(result.converged);
  EXPECT_EQ(result.solved, Solved::concave) << result.reason;
}

/// Of T' with the border: column 0 or both, the other part of the low rank.
Eigen::MatrixXd dense_bordered(double beside, const std::vector<int>& border, const Eigen::VectorXd& scales,
                               const Eigen::Vector2d& coefficients) {
  const auto count = static_cast<Eigen::Index>(border.size());
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(size + count, size + count);
  Eigen::Vector2d others = coefficients;
  others(border).setZero();
  matrix.topLeftCorner(size, size) =
      dense_chain(size, beside) + some_columns() * others.asDiagonal() * some_columns().transpose();
  const Eigen::MatrixXd scaled = -some_columns()(Eigen::all, border) * scales.asDiagonal();
  matrix.topRightCorner(size, count) = scaled;
  matrix.bottomLeftCorner(count, size) = scaled.transpose();
  return matrix;
}

TEST(BorderedSystem, SolvesAndMultipliesAsTheDenseMatrixDoes) {
  const Eigen::Vector2d coefficients(0.5, 2);
  SolverOptions options;
  options.set("test_pc_type", "bjacobi");  // The diagonal alone, which is the same everywhere, would be no test.
  for (const std::vector<int>& border : {std::vector<int>{0}, {1}, {0, 1}}) {
    const auto count = static_cast<Eigen::Index>(border.size());
    const Eigen::VectorXd scales = Eigen::Vector2d(3, 0.2).head(count);
    System given(coefficients, -1);
    BorderedSystem system(given.system, border, scales);
    const Eigen::MatrixXd dense = dense_bordered(-1, border, scales, coefficients);
    VecHandle x;
    VecHandle b;
    check(MatCreateVecs(system.matrix(), x.create(), b.create()));
    const Eigen::VectorXd values = some_values(size + count);
    given.set(b, values, count);
    EXPECT_LT((system.border_values(b) - values.tail(count)).norm(), 1e-15);
    const LinearResult result = system.solve(b, x);
    EXPECT_TRUE(result.converged) << result.reason;
    EXPECT_LT(given.difference(x, dense.partialPivLu().solve(values), count), 1e-8);
    check(MatMult(system.matrix(), b, x));
    EXPECT_LT(given.difference(x, dense * values, count), 1e-12);
  }
}

TEST(BorderedSystem, IsSolvedWhereOnlyTheBorderHoldsTheMatrix) {
  // The chain less a multiple of a column has a negative direction, which the border forbids.
  const Eigen::Vector2d coefficients(20, -0.02);
  System given(coefficients, -0.9);
  const Eigen::VectorXd scales = Eigen::VectorXd::Constant(1, 2);
  const Eigen::MatrixXd dense = dense_bordered(-0.9, {1}, scales, coefficients);
  ASSERT_LT(principal_axes(given.dense).values[0], 0);
  given.system.update(
      {some_columns().middleRows(given.first, given.end - given.first).sparseView(), Eigen::Vector2d(20, 5)});
  BorderedSystem system(given.system, {1}, scales);
  VecHandle x;
  VecHandle b;
  check(MatCreateVecs(system.matrix(), x.create(), b.create()));
  const Eigen::VectorXd values = some_values(size + 1);
  given.set(b, values, 1);
  EXPECT_TRUE(system.solve(b, x).converged);
  EXPECT_LT(given.difference(x, dense.partialPivLu().solve(values), 1), 1e-7);
}

TEST(BorderedSystem, IsSolvedWhereTheBorderTakesEverything) {
  System given({0.5, 2}, -1);
  const Eigen::VectorXd scales = Eigen::Vector2d(3, 0.2);
  BorderedSystem system(given.system, {0, 1}, scales);
  VecHandle x;
  VecHandle b;
  check(MatCreateVecs(system.matrix(), x.create(), b.create()));
  Eigen::VectorXd expected = Eigen::VectorXd::Zero(size + 2);
  expected.tail(2) << 1.5, -4;
  given.set(b, dense_bordered(-1, {0, 1}, scales, {0.5, 2}) * expected, 2);
  const LinearResult result = system.solve(b, x);
  EXPECT_TRUE(result.converged) << result.reason;
  EXPECT_LT(given.difference(x, expected, 2), 1e-13);
}

TEST(BorderedSystem, RefusesTheSameColumnTwice) {
  System given({0.5, 2}, -1);
  const Eigen::MatrixXd twice = some_columns().col(0).replicate(1, 2);
  given.system.update({twice.middleRows(given.first, given.end - given.first).sparseView(), Eigen::Vector2d(0.5, 2)});
  BorderedSystem system(given.system, {0, 1}, Eigen::Vector2d(3, 0.2));
  VecHandle x;
  VecHandle b;
  check(MatCreateVecs(system.matrix(), x.create(), b.create()));
  given.set(b, some_values(size + 2), 2);
  EXPECT_FALSE(system.solve(b, x).converged);
}

TEST(BorderedSystem, ADirectSolverEliminatesBlocks) {
  SolverOptions options;
  options.set("test_ksp_type", "preonly");
  options.set("test_pc_type", "lu");
  options.set("test_pc_factor_mat_solver_type", "mumps");
  const Eigen::VectorXd scales = Eigen::Vector2d(3, 0.2);
  System given({0.5, 2}, -1);
  BorderedSystem system(given.system, {0, 1}, scales);
  VecHandle x;
  VecHandle b;
  check(MatCreateVecs(system.matrix(), x.create(), b.create()));
  const Eigen::VectorXd values = some_values(size + 2);
  given.set(b, values, 2);
  EXPECT_TRUE(system.solve(b, x).converged);
  EXPECT_LT(given.difference(x, dense_bordered(-1, {0, 1}, scales, {0.5, 2}).partialPivLu().solve(values), 2), 1e-9);
}

// Where T' has a negative direction, too, which the row forbids: T less a multiple of the row's column.
TEST(LoadBorder, SolvesAndMultipliesAsTheDenseMatrixDoes) {
  const Eigen::VectorXd load = some_values(size).reverse();
  constexpr double scale = 3;
  for (const double of_first : {0.5, -0.02}) {
    Eigen::MatrixXd columns = some_columns();
    if (of_first < 0) {
      columns.col(0) = columns.col(1);
    }
    System given({0, 0}, -0.9);
    given.system.update(
        {columns.middleRows(given.first, given.end - given.first).sparseView(), Eigen::Vector2d(of_first, 5)});
    Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(size + 1, size + 1);
    dense.topLeftCorner(size, size) = dense_chain(size, -0.9) + of_first * columns.col(0) * columns.col(0).transpose();
    dense.topRightCorner(size, 1) = load;
    dense.bottomLeftCorner(1, size) = scale * columns.col(1).transpose();
    const Eigen::MatrixXd without_border = dense.topLeftCorner(size, size);
    EXPECT_EQ(principal_axes(without_border).values[0] < 0, of_first < 0);
    LoadBorder border(given.system);
    border.update(load.segment(given.first, given.end - given.first), scale);
    VecHandle x;
    VecHandle b;
    check(MatCreateVecs(border.matrix(), x.create(), b.create()));
    const Eigen::VectorXd values = some_values(size + 1);
    given.set(b, values, 1);
    EXPECT_EQ(border.border_values(b)[0], values[size]);
    const LinearResult result = border.solve(b, x);
    EXPECT_TRUE(result.converged) << result.reason;
    EXPECT_LT(given.difference(x, dense.partialPivLu().solve(values), 1), 1e-7);
    check(MatMult(border.matrix(), b, x));
    EXPECT_LT(given.difference(x, dense * values, 1), 1e-12);
  }
}

TEST(LoadBorder, HasNoSolutionWhereTheLoadsDoNotChange) {
  System given({0.5, 20}, -0.9);
  LoadBorder border(given.system);
  border.update(Eigen::VectorXd::Zero(given.end - given.first), 3);
  VecHandle x;
  VecHandle b;
  check(MatCreateVecs(border.matrix(), x.create(), b.create()));
  given.set(b, some_values(size + 1), 1);
  const LinearResult result = border.solve(b, x);
  EXPECT_FALSE(result.converged);
  EXPECT_EQ(result.reason, "the loads do not change any more");
}

TEST(Backtracking, FindsTheLongestShareThatLowersTheMerit) {
  const auto parabola = [](double fraction) { return std::optional((fraction - 0.1) * (fraction - 0.1)); };
  EXPECT_EQ(backtrack(parabola, 0.01, 0.2, 0), 0.125);
  const auto fenced = [&](double fraction) { return fraction > 0.05 ? std::nullopt : parabola(fraction); };
  EXPECT_EQ(backtrack(fenced, 0.01, 0.2, 0), 1.0 / 32);
  const auto rise = [](double fraction) { return std::optional(fraction); };
  EXPECT_FALSE(backtrack(rise, 0, 0, 0));
  EXPECT_EQ(backtrack(rise, 0, 0, 0.3), 0.25) << "a rise by rounding is none";
  EXPECT_FALSE(backtrack([](double) { return std::optional(std::nan("")); }, 0, 0, 0));
}

/// x_i^3 = i + 1 for each row, whose Jacobian is diagonal.
struct Cubes {
  Cubes() : matrix(chain_matrix(size)) { check(MatCreateVecs(matrix, x.create(), diagonal.create())); }

  NewtonProblem problem() {
    NewtonProblem problem;
    problem.residual = [](Vec position, Vec residual) {
      PetscInt first = 0;
      PetscInt end = 0;
      const double* x = nullptr;
      double* f = nullptr;
      check(VecGetOwnershipRange(position, &first, &end));
      check(VecGetArrayRead(position, &x));
      check(VecGetArray(residual, &f));
      for (PetscInt i = 0; i < end - first; ++i) {
        f[i] = x[i] * x[i] * x[i] - static_cast<double>(first + i + 1);
      }
      check(VecRestoreArray(residual, &f));
      check(VecRestoreArrayRead(position, &x));
    };
    problem.update_jacobian = [this](Vec position) {
      check(VecPointwiseMult(diagonal, position, position));
      check(VecScale(diagonal, 3));
    };
    problem.solve = [this](Vec residual, Vec descent, const NewtonRequest&) {
      check(VecPointwiseDivide(descent, residual, diagonal));
      LinearResult result;
      result.iterations = 2;
      if (fails) {
        result.refuse(Solved::no, "it fails");
      }
      return result;
    };
    return problem;
  }

  NewtonDefaults defaults() const {
    NewtonDefaults defaults;
    defaults.rtol = 1e-12;
    defaults.own_tangent = "cubes.tangent";
    return defaults;
  }

  MatHandle matrix;
  VecHandle x;
  VecHandle diagonal;
  bool fails = false;
};

TEST(Newton, FindsTheRootAndCounts) {
  Cubes cubes;
  NewtonProblem problem = cubes.problem();
  int searches = 0;
  problem.search = [&searches](const NewtonStep& step) {
    double norm = 0;
    check(VecNorm(step.residual, NORM_2, &norm));
    EXPECT_GT(norm, 0);
    ++searches;
    return std::optional(1.0);
  };
  Newton newton(cubes.matrix, "cubes_", problem, cubes.defaults());
  check(VecSet(cubes.x, 2));
  const NewtonResult result = newton.solve(cubes.x);
  EXPECT_GT(result.ended, 0);
  EXPECT_EQ(result.linear_iterations, 2 * result.iterations);
  EXPECT_EQ(searches, result.iterations);
  EXPECT_LT(result.residual, 1e-12 * result.start_residual + 1e-30);
  double sum = 0;
  check(VecSum(cubes.x, &sum));
  double expected = 0;
  for (PetscInt i = 1; i <= size; ++i) {
    expected += std::cbrt(static_cast<double>(i));
  }
  EXPECT_NEAR(sum, expected, 1e-9);
}

TEST(Newton, AsksForEisenstatAndWalkersTolerances) {
  Cubes cubes;
  std::vector<double> asked;
  NewtonProblem problem = cubes.problem();
  problem.solve = [&](Vec residual, Vec descent, const NewtonRequest& request) {
    asked.push_back(request.rtol);
    return cubes.problem().solve(residual, descent, request);
  };
  SolverOptions options;
  options.set("cubes_snes_ksp_ew", "");
  options.set("cubes_snes_ksp_ew_rtol0", "0.25");
  Newton newton(cubes.matrix, "cubes_", problem, cubes.defaults());
  check(VecSet(cubes.x, 3));
  EXPECT_GT(newton.solve(cubes.x).ended, 0);
  ASSERT_GT(asked.size(), 3U);
  EXPECT_EQ(asked.front(), 0.25);
  EXPECT_LT(asked.back(), 0.1) << "the nearer, the tighter";
}

TEST(Newton, SaysWhyItEnds) {
  Cubes cubes;
  cubes.fails = true;
  Newton newton(cubes.matrix, "cubes_", cubes.problem(), cubes.defaults());
  check(VecSet(cubes.x, 2));
  const NewtonResult failed = newton.solve(cubes.x);
  EXPECT_EQ(failed.ended, SNES_DIVERGED_LINEAR_SOLVE);
  EXPECT_EQ(failed.linear_failure, "it fails");
  cubes.fails = false;
  NewtonProblem problem = cubes.problem();
  problem.search = [](const NewtonStep&) { return std::optional<double>(); };
  Newton stuck(cubes.matrix, "cubes_", problem, cubes.defaults());
  check(VecSet(cubes.x, 2));
  EXPECT_EQ(stuck.solve(cubes.x).ended, SNES_DIVERGED_LINE_SEARCH);
}

TEST(Newton, LeavesOffAtASignal) {
  catch_stop_signals(0);
  for (const char* type : {SNESNEWTONLS, SNESNEWTONTR, SNESKSPONLY}) {
    SolverOptions options;
    options.set("cubes_snes_type", type);
    defer_stop_signals();
    Cubes cubes;
    NewtonProblem problem = cubes.problem();
    int solves = 0;
    StopPoint within_solve;
    problem.solve = [&](Vec residual, Vec descent, const NewtonRequest& request) {
      if (++solves == 1 && this_rank() == 0) {
        std::raise(SIGUSR2);
      }
      for (int pass = 0; pass < 64; ++pass) {
        within_solve.pass();
        leave_if_stopped();
      }
      return cubes.problem().solve(residual, descent, request);
    };
    Newton newton(cubes.matrix, "cubes_", problem, cubes.defaults());
    check(VecSet(cubes.x, 2));
    EXPECT_EQ(until_stopped(PETSC_COMM_WORLD, [&] { newton.solve(cubes.x); }), SIGUSR2) << type;
    EXPECT_EQ(solves, 1) << type;
    Newton another(cubes.matrix, "cubes_", problem, cubes.defaults());
    EXPECT_EQ(until_stopped(PETSC_COMM_WORLD, [&] { another.solve(cubes.x); }), SIGUSR2) << type;
    EXPECT_EQ(solves, std::string(type) == SNESKSPONLY ? 2 : 1) << "left before it asks for a Jacobian, " << type;
  }
  defer_stop_signals();
}

TEST(Newton, RefusesWhatPassesTheTangentBy) {
  for (const auto& [name, value] : {std::pair{"snes_type", "nrichardson"}, {"snes_fd", "true"}}) {
    SolverOptions options;
    options.set(std::string("cubes_") + name, value);
    Cubes cubes;
    try {
      Newton newton(cubes.matrix, "cubes_", cubes.problem(), cubes.defaults());
      ADD_FAILURE() << name;
    } catch (const Error& error) {
      EXPECT_EQ(std::string(error.what()).find(std::string("-cubes_") + name), 0U) << error.what();
    }
  }
}

}  // namespace
}  // namespace pellicle
