// Solver experiments: whatever solver PETSc's options choose for a colour, the positions are the same.

#include "tests/support/solver_options.h"

#include <gtest/gtest.h>

#include "base/error.h"
#include "tests/projection/sheets.h"
#include "tests/support/grid_mesh.h"

namespace pellicle {
namespace {

Eigen::Matrix3Xd projected(const std::string& mat_type) {
  SheetOptions sheet_options;
  sheet_options.thickness = 0.1;
  sheet_options.perturbation = 0.05;
  Scene scene(make_sheet(PETSC_COMM_WORLD, grid_mesh(7, 6, 0.2), sheet_options));
  scene.x.values() = perturbed_positions(scene.sheet, sheet_options);
  scene.scale_targets(Colour::blue, 0.98);
  ProjectOptions options;
  options.mat_type = mat_type;
  options.ksp_rtol = 1e-12;
  options.max_steps = 2;
  SuccessiveProjection projection(scene.sheet, options);
  const StageResult result = projection.advance(scene.x, scene.input());
  EXPECT_TRUE(result.converged) << result.reason;
  return by_id(scene.sheet, scene.x);
}

/// Sets an option for the solver of each colour.
void set_for_all_colours(SolverOptions& options, const std::string& name, const std::string& value) {
  for (const char* colour : colour_names) {
    options.set(std::string("project_") + colour + "_" + name, value);
  }
}

using Solver = std::tuple<std::string, SolverChoice>;

class ProjectionSolver : public ::testing::TestWithParam<Solver> {};

INSTANTIATE_TEST_SUITE_P(all, ProjectionSolver,
                         ::testing::Combine(::testing::Values("cg", "minres", "gmres"),
                                            ::testing::ValuesIn(solver_choices())),
                         [](const auto& info) { return std::get<0>(info.param) + "_" + std::get<1>(info.param).name; });

TEST_P(ProjectionSolver, GivesTheSamePositions) {
  const auto& [ksp, choice] = GetParam();
  if (choice.one_rank_only && ranks() > 1) {
    GTEST_SKIP() << choice.name << " solves on one rank only";
  }
  const Eigen::Matrix3Xd expected = projected("aij");
  for (const std::string& mat_type : {std::string("aij"), std::string("sell"), ProjectOptions{}.mat_type.name()}) {
    SolverOptions options;
    set_for_all_colours(options, "ksp_type", ksp);
    for (const auto& [name, value] : choice.options) {
      set_for_all_colours(options, name, value);
    }
    EXPECT_LE((projected(mat_type) - expected).cwiseAbs().maxCoeff(), 1e-7) << mat_type;
  }
}

TEST(ProjectionSolverOptions, LinesPreconditionEveryMatrixUnderEverySolver) {
  const Eigen::Matrix3Xd expected = projected("aij");
  for (const char* mat_type : {"lines", "aij", "sell", "shell"}) {
    for (const char* ksp : {"cg", "minres", "gmres"}) {
      SolverOptions options;
      set_for_all_colours(options, "ksp_type", ksp);
      set_for_all_colours(options, "pc_type", "lines");
      EXPECT_LE((projected(mat_type) - expected).cwiseAbs().maxCoeff(), 1e-7) << mat_type << ", " << ksp;
    }
  }
}

TEST(ProjectionSolverOptions, MatrixFreeOperatorTakesNoFactorisation) {
  for (const char* preconditioner : {"icc", "gamg", "cholesky"}) {
    SolverOptions options;
    set_for_all_colours(options, "pc_type", preconditioner);
    try {
      projected("shell");
      FAIL() << preconditioner;
    } catch (const Error& error) {
      const std::string message = error.what();
      EXPECT_NE(message.find(std::string("-project_red_pc_type ") + preconditioner), std::string::npos) << message;
      EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    }
  }
}

TEST(ProjectionSolverOptions, AnAbsoluteToleranceThatMovesNothingIsAFailedSolve) {
  SheetOptions sheet_options;
  sheet_options.thickness = 0.1;
  sheet_options.perturbation = 0.05;
  const auto advance = [&](const char* tolerance, const ProjectOptions& project) {
    SolverOptions options;
    for (const char* variant : {"red_", "green_", "blue_", "yellow_", "joint_"}) {
      options.set(std::string("project_") + variant + "ksp_atol", tolerance);
    }
    Scene scene(make_sheet(PETSC_COMM_WORLD, grid_mesh(7, 6, 0.2), sheet_options));
    scene.x.values() = perturbed_positions(scene.sheet, sheet_options);
    SuccessiveProjection projection(scene.sheet, project);
    return projection.advance(scene.x, scene.input());
  };
  for (const ProjectMethod method : {ProjectMethod::successive, ProjectMethod::joint}) {
    ProjectOptions project;
    project.method = method;
    const StageResult result = advance("1e20", project);
    EXPECT_FALSE(result.converged) << project.method.name();
    EXPECT_NE(result.reason.find("does not solve: it leaves 1.0e+00 of the right-hand side"), std::string::npos)
        << result.reason;
    EXPECT_TRUE(advance("1e-9", project).converged) << project.method.name();
  }
}

TEST(ProjectionSolverOptions, OneColourHasItsOwn) {
  SolverOptions options;
  options.set("project_blue_ksp_max_it", "1");
  SheetOptions sheet_options;
  sheet_options.thickness = 0.1;
  sheet_options.perturbation = 0.05;
  Scene scene(make_sheet(PETSC_COMM_WORLD, grid_mesh(7, 6, 0.2), sheet_options));
  scene.x.values() = perturbed_positions(scene.sheet, sheet_options);
  SuccessiveProjection projection(scene.sheet, tight_options());
  EXPECT_TRUE(projection.project(scene.x, Colour::red, scene.input()).converged);
  const Eigen::MatrixXd before = scene.x.values();
  const StageResult result = projection.project(scene.x, Colour::blue, scene.input());
  EXPECT_FALSE(result.converged);
  EXPECT_NE(result.reason.find("project_blue_"), std::string::npos) << result.reason;
  EXPECT_NE(result.reason.find("DIVERGED_ITS"), std::string::npos) << result.reason;
  EXPECT_EQ(scene.x.values(), before) << "a failed solve moves nothing";
}

}  // namespace
}  // namespace pellicle
