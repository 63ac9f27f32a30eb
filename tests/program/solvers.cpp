// Solver experiments: whatever PETSc solver the command line chooses, the answer is the same.

#include <regex>

#include "tests/support/burning_scene.h"
#include "tests/support/frames.h"
#include "tests/support/program.h"

namespace pellicle {
namespace {

class SolversTest : public ProgramTest {
 protected:
  DrawnFrame run(int ranks, const Arguments& options) {
    const std::string out = "out" + std::to_string(++runs_);
    succeed(ranks, Arguments{write("scene.yaml", burning_scene), "-time_max_steps", "5", "-heat_sources_spot_rate",
                             "1000", "-output_directory", out} +
                       options);
    return last_frame(folder() / out / "scene.pvd");
  }

  /// The same solver for projection and heat.
  static Arguments both(const Arguments& options) {
    Arguments result;
    for (const char* prefix : {"-project_", "-heat_"}) {
      for (const std::string& option : options) {
        result.push_back(option[0] == '-' ? prefix + option.substr(1) : option);
      }
    }
    return result;
  }

 private:
  int runs_ = 0;
};

TEST_F(SolversTest, KrylovMethodsAndPreconditionersOnOneRank) {
  const DrawnFrame reference = run(1, {});
  EXPECT_LT(range_of(reference.points.at("mass_ratio")).first, 0.9);
  for (const char* krylov : {"cg", "minres", "gmres"}) {
    for (const char* preconditioner : {"none", "jacobi", "icc", "bjacobi", "asm", "gamg", "hypre"}) {
      const DrawnFrame frame = run(1, both({"-ksp_type", krylov, "-pc_type", preconditioner}));
      expect_same_fields(reference, frame, agreement, std::string(krylov) + " with " + preconditioner);
    }
  }
}

TEST_F(SolversTest, ASavedSystemIsSolvedAgain) {
  run(2, {"-heat_mat_type", "aij", "-heat_save_system", "heat.bin", "-project_mat_type", "aij",
          "-project_blue_save_system", "blue.bin"});
  for (const char* file : {"heat.bin", "blue.bin"}) {
    for (const int ranks : {1, 3}) {
      const std::string printed =
          succeed(ranks, {"-replay", file, "-replay_ksp_rtol", "1e-10", "-replay_pc_type", "jacobi"}).output;
      std::smatch found;
      ASSERT_TRUE(std::regex_search(printed, found,
                                    std::regex("(\\d+) rows, \\d+ entries\ncg, jacobi: (\\d+) iterations, .* "
                                               "true residual ([0-9.e+-]+) of the right-hand side")))
          << printed;
      EXPECT_GT(std::stoi(found[1]), 100);
      EXPECT_GT(std::stoi(found[2]), 1);
      EXPECT_LT(std::stod(found[3]), 1e-8);
    }
  }
  EXPECT_FALSE(std::filesystem::exists(folder() / "output"));
  write("text.bin", "no system");
  for (const auto& [arguments, words] :
       {std::pair(Arguments{"-replay", "nowhere.bin"}, "nowhere.bin, expected a file"),
        std::pair(Arguments{"-replay", "text.bin"}, "text.bin holds no matrix"),
        std::pair(Arguments{"-replay", "heat.bin", "-replay_ksp_max_it", "1"}, "did not converge"),
        std::pair(Arguments{write("scene.yaml", burning_scene), "-heat_mat_type", "shell", "-heat_save_system", "b"},
                  "-heat_save_system: the matrix is not assembled")}) {
    const CommandResult result = pellicle(1, arguments);
    EXPECT_EQ(result.exit_code, 1) << result;
    EXPECT_EQ(result.error_lines().size(), 1U) << result;
    EXPECT_NE(result.errors.find(words), std::string::npos) << result;
  }
}

TEST_F(SolversTest, KrylovMethodsWithTheDefaultPreconditioner) {
  const DrawnFrame reference = run(1, {"-project_mat_type", "aij", "-project_pc_type", "icc"});
  for (const int ranks : {1, 2}) {
    for (const char* krylov : {"cg", "minres", "gmres"}) {
      const DrawnFrame frame = run(ranks, both({"-ksp_type", krylov}));
      expect_same_fields(reference, frame, agreement, std::string(krylov) + " on " + std::to_string(ranks) + " ranks");
    }
  }
}

TEST_F(SolversTest, DirectSolversOnOneRank) {
  const DrawnFrame reference = run(1, {});
  for (const auto& [factor, library] : {std::pair{"cholesky", "petsc"},
                                        {"lu", "petsc"},
                                        {"cholesky", "mumps"},
                                        {"lu", "mumps"},
                                        {"cholesky", "cholmod"},
                                        {"lu", "umfpack"}}) {
    const DrawnFrame frame =
        run(1, both({"-ksp_type", "preonly", "-pc_type", factor, "-pc_factor_mat_solver_type", library}));
    expect_same_fields(reference, frame, agreement, std::string(factor) + " of " + library);
  }
}

TEST_F(SolversTest, TwoRanks) {
  const DrawnFrame reference = run(1, {});
  for (const auto& [krylov, preconditioner] : {std::pair{"cg", "none"},
                                               {"cg", "icc"},
                                               {"cg", "bjacobi"},
                                               {"cg", "asm"},
                                               {"cg", "gamg"},
                                               {"cg", "hypre"},
                                               {"minres", "jacobi"},
                                               {"gmres", "asm"}}) {
    const DrawnFrame frame = run(2, both({"-ksp_type", krylov, "-pc_type", preconditioner}));
    expect_same_fields(reference, frame, agreement, std::string(krylov) + " with " + preconditioner);
  }
  for (const char* factor : {"cholesky", "lu"}) {
    const DrawnFrame frame =
        run(2, both({"-ksp_type", "preonly", "-pc_type", factor, "-pc_factor_mat_solver_type", "mumps"}));
    expect_same_fields(reference, frame, agreement, std::string(factor) + " of mumps");
  }
}

TEST_F(SolversTest, HookeSprings) {
  const Arguments springs{"-dynamics", "spring", "-spring_newton_tolerance", "1e-9", "-spring_ksp_rtol", "1e-12"};
  const DrawnFrame reference = run(1, springs);
  for (const Arguments& solver : {Arguments{"-spring_ksp_type", "minres", "-spring_pc_type", "jacobi"},
                                  {"-spring_mat_type", "sbaij", "-spring_pc_type", "icc"},
                                  {"-spring_mat_type", "aij", "-spring_pc_type", "gamg"},
                                  {"-spring_mat_type", "aij", "-spring_pc_type", "lu"}}) {
    expect_same_fields(reference, run(1, springs + solver), agreement, solver.back());
  }
}

TEST_F(SolversTest, MatrixFreeWithNoneAndJacobi) {
  const DrawnFrame reference = run(1, {});
  for (const char* preconditioner : {"none", "jacobi"}) {
    const DrawnFrame frame =
        run(1, Arguments{"-project_mat_type", "shell", "-heat_mat_type", "shell"} + both({"-pc_type", preconditioner}));
    expect_same_fields(reference, frame, agreement, preconditioner);
  }
}

TEST_F(SolversTest, LinesPreconditionWhateverTheMatrix) {
  const DrawnFrame reference = run(1, {});
  for (const int ranks : {1, 2}) {
    for (const char* matrix : {"lines", "aij", "shell"}) {
      const DrawnFrame frame =
          run(ranks, {"-project_mat_type", matrix, "-project_pc_type", "lines", "-project_ksp_type", "minres"});
      expect_same_fields(reference, frame, agreement, matrix);
    }
  }
  const CommandResult refused = pellicle(1, {write("scene.yaml", burning_scene), "-heat_pc_type", "lines"});
  EXPECT_NE(refused.exit_code, 0) << refused;
  EXPECT_NE(refused.errors.find("-heat_pc_type lines: "), std::string::npos) << refused;
}

TEST_F(SolversTest, ViewsShowWhatASolverWorksOn) {
  const CommandResult result =
      succeed(1, {write("scene.yaml", burning_scene), "-time_max_steps", "1", "-project_max_steps", "1",
                  "-heat_dm_view", "-heat_mat_view", "::ascii_info", "-project_red_dm_view", "-project_red_ksp_view"});
  EXPECT_EQ(result.errors, "") << "all options were used";
  EXPECT_EQ(count(result.output, "DM Object: temperature \\(heat_\\)"), 1) << result;
  EXPECT_EQ(count(result.output, "DM Object: lambda \\(project_red_\\)"), 1) << result;
  EXPECT_GT(count(result.output, "Mat Object: \\(heat_\\)"), 0) << result;
  EXPECT_GT(count(result.output, "tridiagonal solves along lines of springs"), 0) << result;
}

TEST_F(SolversTest, ReasonsAreToldForEachSolve) {
  const CommandResult result =
      succeed(2, {write("scene.yaml", burning_scene), "-time_max_steps", "1", "-project_max_steps", "3",
                  "-project_ksp_converged_reason", "-heat_ksp_converged_reason"});
  EXPECT_EQ(count(result.output, "Linear heat_ solve converged due to CONVERGED_RTOL"), 1) << result;
  for (const char* colour : {"red", "green", "blue", "yellow"}) {
    EXPECT_EQ(count(result.output, std::string("Linear project_") + colour + "_ solve converged"), 3) << result;
  }
}

TEST_F(SolversTest, OneColourCanBeAskedAlone) {
  const CommandResult result =
      succeed(1, {write("scene.yaml", burning_scene), "-time_max_steps", "1", "-project_max_steps", "2",
                  "-project_blue_ksp_converged_reason", "-project_green_ksp_monitor"});
  EXPECT_EQ(count(result.output, "Linear project_blue_ solve converged"), 2) << result;
  EXPECT_EQ(count(result.output, "Linear project_(red|green|yellow)_ solve converged"), 0) << result;
  EXPECT_GT(count(result.output, "KSP Residual norm"), 5) << result;
  EXPECT_EQ(count(result.output, "Residual norms for project_green_ solve"), 2) << result;
}

TEST_F(SolversTest, ViewShowsTheOverriddenColour) {
  const CommandResult result =
      succeed(1, {write("scene.yaml", burning_scene), "-time_max_steps", "1", "-project_max_steps", "1",
                  "-project_ksp_view", "-project_pc_type", "jacobi", "-project_red_pc_type", "cholesky"});
  for (const auto& [colour, type] :
       {std::pair{"red", "cholesky"}, {"green", "jacobi"}, {"blue", "jacobi"}, {"yellow", "jacobi"}}) {
    const std::string pattern =
        std::string("PC Object: \\(project_") + colour + "_\\) 1 MPI process(es)?\n  type: " + type;
    EXPECT_EQ(count(result.output, pattern), 1) << pattern << "\n" << result;
  }
}

TEST_F(SolversTest, ASolverThatStopsTooEarlyIsAFailureWithItsReason) {
  const CommandResult result = pellicle(2, {write("scene.yaml", burning_scene), "-heat_ksp_max_it", "1",
                                            "-heat_pc_type", "none", "-time_max_retries", "1"});
  EXPECT_NE(result.exit_code, 0) << result;
  ASSERT_EQ(result.error_lines().size(), 1u) << result;
  EXPECT_NE(result.errors.find("heat_"), std::string::npos) << result;
  EXPECT_NE(result.errors.find("DIVERGED_ITS"), std::string::npos) << result;
  EXPECT_EQ(read_pvd(folder() / "out" / "scene.pvd").size(), 1u) << "the state before the failure is the last frame";
}

}  // namespace
}  // namespace pellicle
