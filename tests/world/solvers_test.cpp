// Solver experiments: whatever solvers PETSc's options choose for heat and projection, the chain gives the same answer.

#include <gtest/gtest.h>

#include "tests/io/files.h"
#include "tests/support/alone.h"
#include "tests/support/by_id.h"
#include "tests/support/grid_mesh.h"
#include "tests/support/solver_options.h"

namespace pellicle::solvers_test {
namespace {

struct Answer {
  Eigen::MatrixXd position;
  Eigen::MatrixXd temperature;
};

Answer burn_two_steps(const std::string& heat_operator, const std::string& heat_matrix) {
  Options options;
  options.sheet.thickness = 0.05;
  options.sheet.perturbation = 0.05;
  HeatSource ball;
  ball.centre = {0.2, 0.3, 0};
  ball.radius = 0.3;
  ball.rate = 1000;
  options.heat.sources["ball"] = ball;
  options.heat.operator_name = heat_operator;
  options.heat.mat_type = heat_matrix;
  options.heat.diffusivity = 0.05;
  options.heat.ksp_rtol = 1e-12;
  options.combustion.mass_loss_rate = 0.1;
  options.project.ksp_rtol = 1e-12;
  options.project.mat_type = "aij";
  options.project.max_steps = 2;
  Alone sheet(grid_mesh(7, 6, 0.1), options);
  for (int step = 0; step < 2; ++step) {
    const AloneStep result = sheet.advance(5e-3);
    EXPECT_TRUE(result.converged) << result.reason;
  }
  return {by_id(sheet.surface(), sheet.state().position), by_id(sheet.surface(), sheet.burning().temperature)};
}

class Solvers : public ::testing::TestWithParam<SolverChoice> {};
INSTANTIATE_TEST_SUITE_P(all, Solvers, ::testing::ValuesIn(solver_choices()),
                         [](const auto& info) { return info.param.name; });

TEST_P(Solvers, GiveTheSameAnswer) {
  const SolverChoice& choice = GetParam();
  if (choice.one_rank_only && ranks() > 1) {
    GTEST_SKIP() << choice.name << " solves on one rank only";
  }
  for (const char* heat_operator : {"umbrella", "consistent"}) {
    const Answer expected = burn_two_steps(heat_operator, "aij");
    EXPECT_GT(expected.temperature.maxCoeff(), 600);
    for (const char* ksp : {"cg", "minres", "gmres"}) {
      SolverOptions options;
      for (const char* prefix : {"heat_", "project_red_", "project_green_", "project_blue_", "project_yellow_"}) {
        options.set(std::string(prefix) + "ksp_type", ksp);
        for (const auto& [name, value] : choice.options) {
          options.set(prefix + name, value);
        }
      }
      const Answer answer = burn_two_steps(heat_operator, "aij");
      EXPECT_LE((answer.position - expected.position).cwiseAbs().maxCoeff(), 1e-7) << ksp;
      EXPECT_LE((answer.temperature - expected.temperature).cwiseAbs().maxCoeff(), 1e-7 * 700) << ksp;
    }
  }
}

TEST(HeatSolver, MatrixFreeOperatorTakesNoFactorisation) {
  const Answer expected = burn_two_steps("umbrella", "aij");
  for (const char* preconditioner : {"none", "jacobi"}) {
    SolverOptions options;
    options.set("heat_pc_type", preconditioner);
    const Answer answer = burn_two_steps("umbrella", "shell");
    EXPECT_LE((answer.temperature - expected.temperature).cwiseAbs().maxCoeff(), 1e-7 * 700) << preconditioner;
  }
  SolverOptions options;
  options.set("heat_pc_type", "icc");
  const std::string message = error_text([] { burn_two_steps("umbrella", "shell"); });
  EXPECT_NE(message.find("-heat_pc_type icc"), std::string::npos) << message;
  EXPECT_EQ(message.find('\n'), std::string::npos) << message;
}

}  // namespace
}  // namespace pellicle::solvers_test
