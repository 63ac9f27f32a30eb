// The factor of the interface's matrix against dense solutions and eigenvalues, dense by LAPACK and sparse by MUMPS.

#include "linear/mumps_factor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>

#include "geometry/principal_axes.h"
#include "tests/support/solver_options.h"

namespace pellicle {
namespace {

constexpr int unknowns = 24;

/// Entries of one half, in turns above and below the diagonal, of points no further than a reach apart.
struct Entries {
  explicit Entries(int reach) {
    for (int i = 0; i < unknowns; ++i) {
      for (int j = i; j < unknowns; ++j) {
        if (j / 3 - i / 3 <= reach) {
          rows.push_back((i + j) % 2 == 0 ? i + 1 : j + 1);
          columns.push_back((i + j) % 2 == 0 ? j + 1 : i + 1);
        }
      }
    }
    rows.push_back(1);  // comes twice
    columns.push_back(1);
  }
  std::vector<double> values(double shift) const {
    std::vector<double> result;
    for (std::size_t k = 0; k < rows.size(); ++k) {
      result.push_back(std::cos(3.0 * rows[k] * columns[k]) + (rows[k] == columns[k] ? shift : 0));
    }
    return result;
  }
  Eigen::MatrixXd matrix(const std::vector<double>& values) const {
    Eigen::MatrixXd result = Eigen::MatrixXd::Zero(unknowns, unknowns);
    for (std::size_t k = 0; k < rows.size(); ++k) {
      result(rows[k] - 1, columns[k] - 1) += values[k];
      if (rows[k] != columns[k]) {
        result(columns[k] - 1, rows[k] - 1) += values[k];
      }
    }
    return result;
  }

  std::vector<int> rows;
  std::vector<int> columns;
};

class InterfaceFactors : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Reaches, InterfaceFactors, ::testing::Values(1, 3, unknowns));

TEST_P(InterfaceFactors, SolveAndCountNegativeEigenvalues) {
  const Entries entries(GetParam());
  InterfaceFactor factor(entries.rows, entries.columns, unknowns, "");
  const Eigen::VectorXd load = Eigen::VectorXd::LinSpaced(unknowns, -1, 2);
  for (const double shift : {20.0, 3.0, 0.0, -2.0, -20.0}) {
    factor.values() = entries.values(shift);
    const Eigen::MatrixXd matrix = entries.matrix(factor.values());
    const Eigen::VectorXd eigenvalues = principal_axes(matrix).values;
    ASSERT_TRUE(factor.refresh());
    EXPECT_EQ(factor.negative(), (eigenvalues.array() < 0).count()) << shift;
    Eigen::VectorXd solution = load;
    factor.solve(solution);
    EXPECT_LT((matrix * solution - load).norm(), 1e-10 * load.norm()) << shift;
  }
}

TEST(InterfaceFactor, SaysThatADenseMatrixIsSingular) {
  const Entries entries(unknowns);
  InterfaceFactor factor(entries.rows, entries.columns, unknowns, "");
  factor.values().assign(entries.rows.size(), 0);
  EXPECT_FALSE(factor.refresh());
}

TEST(InterfaceFactor, MayBeOfNothing) {
  InterfaceFactor factor({}, {}, 0, "");
  Eigen::VectorXd nothing(0);
  EXPECT_TRUE(factor.refresh());
  EXPECT_EQ(factor.negative(), 0);
  factor.solve(nothing);
}

// The options are those of PETSc's interface to MUMPS, except the settings that the class makes itself. The program
// warns of options that rank 0 has not read.
TEST(MumpsFactor, ReadsItsOptionsAlsoIfItHasNoUnknowns) {
  const std::set<int> settings{1,  2,  3,  4,  6,  7,  8,  10, 11, 12, 13, 14, 15,
                               22, 23, 24, 25, 27, 28, 29, 31, 33, 35, 36, 38};
  const std::set<int> numbers{1, 2, 3, 4, 5, 7};
  const auto name = [](const char* kind, int number) {
    return "nothing_mat_mumps_" + std::string(kind) + "_" + std::to_string(number);
  };
  SolverOptions given;
  for (int number = 1; number <= 60; ++number) {
    given.set(name("icntl", number), "0");
    given.set(name("cntl", number), "0");
  }
  const MumpsFactor factor({}, {}, 0, 0, "nothing_");
  const auto is_used = [](const std::string& option) {
    PetscBool used = PETSC_FALSE;
    check(PetscOptionsUsed(nullptr, option.c_str(), &used));
    return used == PETSC_TRUE;
  };
  for (int number = 1; number <= 60; ++number) {
    EXPECT_EQ(is_used(name("icntl", number)), settings.count(number) > 0) << number;
    EXPECT_EQ(is_used(name("cntl", number)), numbers.count(number) > 0) << number;
  }
}

}  // namespace
}  // namespace pellicle
