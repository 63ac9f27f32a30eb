#include "solvers/newton.h"

#include <gtest/gtest.h>

#include <vector>

#include "base/error.h"
#include "tests/solvers/chain_matrix.h"
#include "tests/support/solver_options.h"

namespace pellicle {
namespace {

/// Relative tolerances for which Newton's method asks on its way to x^3 = 1, from x = 3.
std::vector<double> tolerances(const std::vector<std::pair<std::string, std::string>>& given) {
  SolverOptions options;
  for (const auto& [name, value] : given) {
    options.set("cubic_" + name, value);
  }
  const MatHandle matrix = chain_matrix(4, -1);
  VecHandle x;
  check(MatCreateVecs(matrix, x.create(), nullptr));
  check(VecSet(x, 3));
  std::vector<double> asked;
  NewtonProblem problem;
  problem.residual = [](Vec position, Vec residual) {
    check(VecPointwiseMult(residual, position, position));
    check(VecPointwiseMult(residual, residual, position));
    check(VecShift(residual, -1));
  };
  VecHandle slope;
  check(VecDuplicate(x, slope.create()));
  problem.update_jacobian = [&slope](Vec position) {
    check(VecPointwiseMult(slope, position, position));
    check(VecScale(slope, 3));
  };
  problem.solve = [&](Vec residual, Vec descent, const NewtonRequest& request) {
    asked.push_back(request.rtol);
    check(VecPointwiseDivide(descent, residual, slope));
    LinearResult result;
    result.reason = KSP_CONVERGED_RTOL;
    return result;
  };
  NewtonDefaults defaults;
  defaults.ksp_rtol = 1e-6;
  Newton newton(matrix, "cubic_", problem, defaults);
  EXPECT_GT(newton.solve(x).ended, 0);
  return asked;
}

TEST(Newton, AsksForEisenstatAndWalkersTolerances) {
  const std::vector<double> asked = tolerances({{"snes_ksp_ew", ""}, {"snes_ksp_ew_rtol0", "0.25"}});
  ASSERT_GT(asked.size(), 3U);
  EXPECT_EQ(asked.front(), 0.25);
  EXPECT_LT(asked.back(), 0.1) << "the nearer, the tighter";
}

}  // namespace
}  // namespace pellicle
