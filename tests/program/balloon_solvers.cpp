// Balloons, solver experiments: whatever matrix, tangent or PETSc solver the command line chooses, the answer is the
// same.

#include <algorithm>
#include <map>
#include <numeric>
#include <regex>

#include "tests/support/balloon_scene.h"
#include "tests/support/frames.h"
#include "tests/support/program.h"
#include "tests/support/shared_folder.h"

namespace pellicle {
namespace {

class BalloonSolversTest : public ProgramTest {
 protected:
  BalloonSolversTest() {
    write("balloons.obj", balloon_scene_mesh());
    write("scene.yaml", balloon_scene);
  }

  /// Some steps of the scene. @returns the last frame.
  DrawnFrame run(int ranks, const Arguments& options, int steps = 3) {
    const std::string out = "out" + std::to_string(++runs_);
    const std::string count = std::to_string(steps);
    const CommandResult result = succeed(ranks, Arguments{"scene.yaml", "-time_max_steps", count,
                                                          "-output_interval_steps", count, "-output_directory", out} +
                                                    options);
    EXPECT_EQ(result.errors, "") << "all options were used";
    output_ = result.output;
    history_ = read_csv(folder() / out / "history.csv");
    EXPECT_EQ(history_.at("retries"), std::vector<double>(static_cast<std::size_t>(steps) + 1, 0))
        << "no step was halved: " << options.back();
    return last_frame(folder() / out / "scene.pvd");
  }

  /// Expects that a run is refused, or a step of it fails, with one line that has these words.
  void expect_failure(const Arguments& arguments, const std::string& words) const {
    const CommandResult result = pellicle(1, arguments);
    EXPECT_EQ(result.exit_code, 1) << result;
    EXPECT_EQ(result.error_lines().size(), 1U) << result;
    EXPECT_NE(result.errors.find(words), std::string::npos) << "expected " << words << "\n" << result;
  }

  std::map<std::string, std::vector<double>> history_;  ///< of the last run
  std::string output_;                                  ///< likewise, what it printed

 private:
  int runs_ = 0;
};

/// The scene must have moved, or agreement would say nothing.
void expect_something_happened(const DrawnFrame& frame) {
  const auto [low, high] = range_of(frame.cell_values.at("stretch"));
  EXPECT_GT(high, 1.01) << "it swells";
  EXPECT_LT(low, 1.005);
  EXPECT_GT(range_of(frame.points.at("velocity"), 0).second, 0.03) << "it moves";
}

TEST_F(BalloonSolversTest, StorageOfTheMatrixAndTheKernelDoNotMatter) {
  const DrawnFrame reference = run(1, {"-prism_mat_type", "baij", "-prism_tangent", "exact"});
  expect_something_happened(reference);
  for (const int ranks : {1, 3}) {
    for (const char* storage : {"baij", "aij", "sbaij", "shell"}) {
      for (const char* tangent : {"exact", "gradient"}) {
        const DrawnFrame other = run(ranks, {"-prism_mat_type", storage, "-prism_tangent", tangent});
        expect_same_balloon(reference, other, agreement,
                            std::string(storage) + ", " + tangent + " on " + std::to_string(ranks) + " ranks");
      }
    }
  }
}

TEST_F(BalloonSolversTest, EveryGasTangentGivesTheSameConvergedAnswer) {
  // What a tangent misses costs iterations, not exactness. All gas is the paper's: against the ambient pressure its
  // factor of a third is too little for Newton's method.
  const Arguments relative{
      write("relative.yaml",
            "chambers:\n"
            "  dome: {law: relative, amount_ratio: [], pressure: [[0, 0], [0.01, 30], [0.03, 600], "
            "[0.1, 6000]]}\n"),
      "-gas_tangent"};
  const DrawnFrame exact = run(1, relative + Arguments{"exact"}, 8);
  EXPECT_LE(history_.at("newton_iterations").back(), 4);
  for (const char* tangent : {"paper", "rank1"}) {
    const DrawnFrame other = run(1, relative + Arguments{tangent}, 8);
    EXPECT_GT(history_.at("newton_iterations").back(), 4) << tangent;
    expect_same_balloon(exact, other, agreement, std::string("gas.tangent ") + tangent);
  }
}

TEST_F(BalloonSolversTest, KrylovMethodsAndPreconditioners) {
  const DrawnFrame reference = run(1, {});
  expect_something_happened(reference);
  for (const auto& [storage, preconditioner] : {std::pair{"baij", "mg"},
                                                {"baij", "pbjacobi"},
                                                {"baij", "none"},
                                                {"baij", "bjacobi"},
                                                {"baij", "icc"},
                                                {"baij", "hypre"},
                                                {"aij", "gamg"},
                                                {"aij", "hypre"},
                                                {"aij", "asm"},
                                                {"sbaij", "icc"},
                                                {"sbaij", "jacobi"},
                                                {"shell", "jacobi"}}) {
    for (const int ranks : {1, 2}) {
      const DrawnFrame frame = run(ranks, {"-prism_mat_type", storage, "-prism_pc_type", preconditioner});
      expect_same_balloon(reference, frame, agreement,
                          std::string(storage) + " with " + preconditioner + " on " + std::to_string(ranks) + " ranks");
    }
  }
  for (const char* krylov : {"minres", "gmres"}) {
    expect_same_balloon(reference, run(1, {"-prism_ksp_type", krylov, "-prism_pc_type", "pbjacobi"}), agreement,
                        krylov);
  }
}

TEST_F(BalloonSolversTest, DirectSolvers) {
  // They factor the sparse part; a few iterations take in the gas, which is of low rank.
  const DrawnFrame reference = run(1, {});
  for (const auto& [storage, factor] :
       {std::pair{"baij", "lu"}, {"baij", "cholesky"}, {"aij", "lu"}, {"aij", "cholesky"}, {"sbaij", "cholesky"}}) {
    expect_same_balloon(reference, run(1, {"-prism_mat_type", storage, "-prism_pc_type", factor}), agreement,
                        std::string(storage) + " with " + factor);
    EXPECT_LE(history_.at("linear_iterations").back(), 5 * history_.at("newton_iterations").back()) << factor;
  }
  expect_same_balloon(
      reference,
      run(2, {"-prism_mat_type", "aij", "-prism_pc_type", "cholesky", "-prism_pc_factor_mat_solver_type", "mumps"}),
      agreement, "mumps");
}

TEST_F(BalloonSolversTest, DirectSolversWithoutAKrylovMethodTakeInTheGasToo) {
  // One solve for each Newton iteration and one for each chamber's part: no iteration could mend what is left out.
  const Arguments volume{
      write("volume.yaml", "chambers: {ball: {law: volume, pressure: [], volume_ratio: [[0, 1], [0.1, 1.5]]}}\n")};
  const Arguments mumps{"-prism_mat_type", "aij", "-prism_pc_factor_mat_solver_type", "mumps"};
  for (const Arguments& scene : {Arguments{}, volume}) {
    const DrawnFrame reference = run(1, scene);
    const std::vector<double> newton = history_.at("newton_iterations");
    for (const auto& [ranks, choice] : {std::pair{1, Arguments{}}, {1, mumps}, {3, mumps}}) {
      expect_same_balloon(
          reference, run(ranks, scene + choice + Arguments{"-prism_pc_type", "cholesky", "-prism_ksp_type", "preonly"}),
          agreement, "preonly");
      EXPECT_EQ(history_.at("newton_iterations"), newton) << "the same iteration, as exact as it";
    }
  }
}

TEST_F(BalloonSolversTest, WhereTheTangentIsNotPositiveDefiniteTheStepDoesNotDependOnTheSolver) {
  // In step 7 the side is pulled so hard that conjugate gradients meet a direction of negative curvature, how soon
  // depends on the preconditioner.
  const Arguments scene{write("aside.yaml", "attachments: {side: {path: [[0, 0, 0, 0], [0.1, -0.02, 0.004, 0]]}}\n")};
  const DrawnFrame reference = run(1, scene, 8);
  EXPECT_EQ(history_.at("concave_iterations"), (std::vector<double>{0, 0, 0, 0, 0, 0, 0, 1, 0}));
  EXPECT_NE(output_.find("equilibria: in 1 of 8 steps, first in step 7"), std::string::npos) << output_;
  const Arguments few{"-prism_newton", "fixed", "-prism_snes_max_it", "2"};
  const DrawnFrame after_few = run(1, scene + few, 7);
  EXPECT_GT(history_.at("relative_residual").back(), 1e-9) << "not at its end";
  for (const Arguments& solver : {Arguments{"-prism_patch_size", "10"}, {"-prism_pc_type", "none"}}) {
    expect_same_balloon(reference, run(1, scene + solver, 8), agreement, solver.back());
    expect_same_balloon(after_few, run(1, scene + few + solver, 7), agreement, solver.back() + ", in between");
    EXPECT_EQ(history_.at("concave_iterations").back(), 1) << solver.back();
  }
  expect_same_balloon(after_few, run(4, scene + few, 7), agreement, "4 ranks, in between");
}

TEST_F(BalloonSolversTest, ABrokenPreconditionerIsAFailureWithItsReason) {
  expect_failure({"scene.yaml", "-time_max_retries", "1", "-prism_mat_type", "aij", "-prism_pc_type", "fieldsplit"},
                 "DIVERGED_INDEFINITE_PC after");
  const std::string homer = (shared_folder() / "meshes" / "homer.obj").string();
  if (std::filesystem::exists(homer)) {
    expect_failure({PELLICLE_SOURCE_DIR "/input/teddy.yaml", "-mesh_file", homer, "-time_max_retries", "0",
                    "-output_directory", "homer", "-prism_pc_type", "icc"},
                   "the preconditioner icc is not positive definite");
  }
}

TEST_F(BalloonSolversTest, WhatCannotSolveTheStepIsRefusedByItsName) {
  for (const Arguments& choice : {Arguments{"-prism_snes_type", "qn"},
                                  {"-prism_snes_type", "anderson"},
                                  {"-prism_snes_mf"},
                                  {"-prism_pc_type", "fieldsplit"},
                                  {"-prism_pc_type", "exotic"},
                                  {"-prism_pc_mg_type", "multiplicative"},
                                  {"-prism_pc_mg_levels", "3"}}) {
    expect_failure(Arguments{"scene.yaml"} + choice,
                   choice.size() == 1 ? choice[0] + ": " : choice[0] + " " + choice[1] + ": ");
  }
  expect_failure({"scene.yaml", "-prism_ksp_type", "preonly", "-prism_pc_type", "jacobi", "-time_max_retries", "0"},
                 "the linear solver prism_ (preonly) does not solve: it leaves");
}

TEST_F(BalloonSolversTest, FieldsHaveNames) {
  const DrawnFrame reference = run(1, {});
  const DrawnFrame split =
      run(1, {"-prism_mat_type", "aij", "-prism_pc_type", "fieldsplit", "-prism_pc_fieldsplit_type", "additive",
              "-prism_fieldsplit_x_pc_type", "icc", "-prism_fieldsplit_y_pc_type", "jacobi",
              "-prism_fieldsplit_z_pc_type", "icc", "-prism_dm_view", "-prism_mat_view", "::ascii_info"});
  expect_same_balloon(reference, split, agreement, "split into directions");
  EXPECT_NE(output_.find("DM Object: x, y, z (prism_)"), std::string::npos) << output_;
  EXPECT_NE(output_.find("Mat Object: (prism_)"), std::string::npos) << output_;
}

TEST_F(BalloonSolversTest, AStepThatEndsOutOfBalanceIsSaid) {
  run(2, {"-prism_newton", "fixed", "-prism_snes_max_it", "1"});
  const std::vector<double>& relative = history_.at("relative_residual");
  EXPECT_GT(relative[1], 0.1);
  EXPECT_LT(relative[1], 1);
  EXPECT_NE(output_.find("residual: 3 of 3 steps ended above prism.residual_tolerance"), std::string::npos) << output_;
  run(1, {"-prism_newton", "fixed", "-prism_snes_max_it", "1", "-prism_residual_tolerance", "0.99"});
  EXPECT_EQ(output_.find("residual:"), std::string::npos) << output_;
  run(1, {});
  EXPECT_LT(history_.at("relative_residual").back(), 1e-9);
  EXPECT_EQ(output_.find("residual:"), std::string::npos) << output_;
  // So far from the origin that places are rounded to more than what the tolerance asks for.
  run(2, {"-mesh_shift", "0,1e5,0", "-pins_top_centre", "0,1e5,0.25", "-attachments_side_box",
          "-0.07,99999.98,0.001,-0.04,100000.02,0.03"});
  EXPECT_GT(history_.at("relative_residual")[1], 1e-8);
  EXPECT_NE(output_.find("steps ended above prism.snes_rtol, as far as the rounding of the places lets Newton's method "
                         "go: out of balance by"),
            std::string::npos)
      << output_;
}

TEST_F(BalloonSolversTest, AStepWhoseResidualGrowsIsTriedAgainSmaller) {
  const CommandResult result = succeed(1, {PELLICLE_SOURCE_DIR "/input/bird.yaml", "-mesh_vertices", "600",
                                           "-time_step", "40 ms", "-time_max_steps", "1", "-output_directory", "bird"});
  EXPECT_NE(result.output.find("step 1 at time 0 s failed: Newton's iterations made the residual grow, from "),
            std::string::npos)
      << result;
  EXPECT_GT(read_csv(folder() / "bird" / "history.csv").at("retries").back(), 0);
}

TEST_F(BalloonSolversTest, NewtonsMethodByChoice) {
  const DrawnFrame reference = run(1, {});
  for (const Arguments& choice : {Arguments{"-prism_snes_type", "newtontr"},
                                  {"-prism_snes_linesearch_type", "bt"},
                                  {"-prism_snes_linesearch_type", "basic"},
                                  {"-prism_line_search", "false"},
                                  {"-prism_positive_elements", "false"}}) {
    expect_same_balloon(reference, run(1, choice), agreement, choice.front() + " " + choice.back());
  }
  // One linear solve a step: the implicit step of cloth simulation, near to the converged one here.
  const DrawnFrame once = run(1, {"-prism_snes_type", "ksponly"});
  EXPECT_EQ(history_.at("newton_iterations").back(), 1);
  EXPECT_LT(relative_difference(reference.points.at("position"), once.points.at("position")), 1e-3);
}

// With what compression takes from the geometric stiffness left out also where the step ends, Newton's method converges
// linearly: 15 iterations a step of the vase in the mean, 40 at most.
TEST_F(BalloonSolversTest, ASlackWallThatWrinklesTakesFewIterations) {
  std::vector<DrawnFrame> ends;
  for (const int ranks : {1, 3}) {
    const std::string out = "vase" + std::to_string(ranks);
    succeed(ranks, {PELLICLE_SOURCE_DIR "/input/vase.yaml", "-mesh_vertices", "600", "-prism_newton", "converged",
                    "-prism_ksp_rtol", "1e-10", "-time_step", "2 ms", "-time_max_steps", "20", "-output_interval_steps",
                    "20", "-output_directory", out});
    const auto history = read_csv(folder() / out / "history.csv");
    const std::vector<double>& iterations = history.at("newton_iterations");
    ASSERT_EQ(iterations.size(), 21U);
    EXPECT_LT(std::accumulate(iterations.begin(), iterations.end(), 0.0), 20 * 5);
    EXPECT_LE(*std::max_element(iterations.begin(), iterations.end()), 8);
    EXPECT_GT(*std::max_element(history.at("concave_iterations").begin(), history.at("concave_iterations").end()), 0);
    EXPECT_LT(*std::max_element(history.at("relative_residual").begin(), history.at("relative_residual").end()), 1e-7);
    EXPECT_EQ(*std::max_element(history.at("retries").begin(), history.at("retries").end()), 0);
    ends.push_back(last_frame(folder() / out / "vase.pvd"));
  }
  expect_same_balloon(ends[0], ends[1], agreement, "ranks");
}

// A slack wall: by iterations a solve takes several hundred.
TEST_F(BalloonSolversTest, WhereIterationsAreSlowTheTangentIsFactorised) {
  const auto vase = [&](int ranks, const Arguments& choice) {
    const std::string out = "vase_" + std::to_string(ranks) + choice.back();
    output_ = succeed(ranks, Arguments{PELLICLE_SOURCE_DIR "/input/vase.yaml", "-mesh_vertices", "600", "-prism_newton",
                                       "converged", "-prism_ksp_rtol", "1e-10", "-time_step", "5 ms", "-time_max_steps",
                                       "3", "-output_interval_steps", "3", "-output_directory", out} +
                                 choice)
                  .output;
    history_ = read_csv(folder() / out / "history.csv");
    return last_frame(folder() / out / "vase.pvd");
  };
  const auto iterations_of_a_solve = [&] {
    const std::vector<double>& linear = history_.at("linear_iterations");
    const std::vector<double>& newton = history_.at("newton_iterations");
    return std::accumulate(linear.begin(), linear.end(), 0.0) / std::accumulate(newton.begin(), newton.end(), 0.0);
  };
  const DrawnFrame reference = vase(1, {"-prism_factor", "never"});
  EXPECT_NE(output_.find("linear solver: cg, mg with rigid patches\n"), std::string::npos) << output_;
  EXPECT_EQ(output_.find("factorised"), std::string::npos) << output_;
  EXPECT_GT(iterations_of_a_solve(), 100);
  for (const int ranks : {1, 2, 4}) {
    expect_same_balloon(reference, vase(ranks, {"-prism_factor", "auto"}), agreement, std::to_string(ranks) + " ranks");
    EXPECT_NE(output_.find("linear solver: cg, mg with rigid patches; with a factorisation where a solve takes more "
                           "than 100 iterations"),
              std::string::npos)
        << output_;
    EXPECT_NE(output_.find("step 1: the tangent is factorised"), std::string::npos) << output_;
    EXPECT_NE(output_.find("linear solver: the tangent was factorised in 3 steps"), std::string::npos) << output_;
    EXPECT_LT(iterations_of_a_solve(), 30);
  }
  expect_same_balloon(reference, vase(1, {"-prism_mat_type", "sbaij", "-prism_factor", "always"}), agreement, "always");
  EXPECT_NE(output_.find("linear solver: cg with a factorisation\n"), std::string::npos) << output_;
  EXPECT_LE(iterations_of_a_solve(), 2);
  vase(1, {"-prism_pc_type", "pbjacobi"});
  EXPECT_EQ(output_.find("factoris"), std::string::npos) << "the user has chosen: " << output_;
}

// In steps 3 and 4 conjugate gradients meet a concave direction before they are slow, and are slow only with the
// tangent that is then taken in its place.
TEST_F(BalloonSolversTest, WhereATangentInPlaceOfAConcaveOneIsSlowItIsFactorised) {
  succeed(1, {PELLICLE_SOURCE_DIR "/input/cube_cylinder.yaml", "-mesh_vertices", "600", "-prism_newton", "converged",
              "-time_max_steps", "5", "-output_directory", "out"});
  const auto history = read_csv(folder() / "out" / "history.csv");
  EXPECT_EQ(history.at("retries"), std::vector<double>(6, 0));
  EXPECT_GT(*std::max_element(history.at("concave_iterations").begin(), history.at("concave_iterations").end()), 0);
  EXPECT_LT(*std::max_element(history.at("relative_residual").begin(), history.at("relative_residual").end()), 1e-8);
}

TEST_F(BalloonSolversTest, AFactorisedPrescribedVolumeWithoutInertiaGoesBeyondTheLimitPoint) {
  const Arguments scene{write(
      "limit.yaml",
      "chain: inflate\nmesh: {shape: icosphere, level: 2, radius: 0.05}\ntime: {step: 0.05, end: 1}\n"
      "force: {gravity: [0, 0, 0]}\nwall: {thickness: 0.2 mm, material: neo_hookean, mu: 0.4 MPa, bending: none}\n"
      "prism: {inertia: false, mass_damping: 1e-3}\n"
      "chambers: {gas: {law: volume, volume_ratio: [[0, 1], [1, 8]]}}\noutput: {directory: out, name: limit}\n")};
  std::vector<std::vector<double>> pressures;
  for (const auto& [ranks, factor] : {std::pair{1, "never"}, {1, "always"}, {3, "always"}}) {
    const std::string out = std::string("limit_") + factor + std::to_string(ranks);
    succeed(ranks, scene + Arguments{"-output_directory", out, "-prism_factor", factor});
    const auto history = read_csv(folder() / out / "history.csv");
    EXPECT_EQ(*std::max_element(history.at("retries").begin(), history.at("retries").end()), 0);
    pressures.push_back(history.at("gas_pressure"));
  }
  const double largest = *std::max_element(pressures[0].begin(), pressures[0].end());
  EXPECT_LT(pressures[0].back(), 0.95 * largest) << "beyond the limit point";
  for (const std::vector<double>& other : {pressures[1], pressures[2]}) {
    ASSERT_EQ(other.size(), pressures[0].size());
    for (std::size_t i = 0; i < other.size(); ++i) {
      EXPECT_NEAR(other[i], pressures[0][i], 1e-6 * largest) << i;
    }
  }
}

TEST_F(BalloonSolversTest, FactorisedStepsAreTheSameAfterARestart) {
  for (const int ranks : {1, 2}) {
    const CommandResult result =
        succeed(ranks, {PELLICLE_SOURCE_DIR "/input/vase.yaml", "-mesh_vertices", "600", "-prism_newton", "converged",
                        "-time_step", "5 ms", "-verify_restart", "3", "-output_directory", "verified"});
    EXPECT_NE(result.output.find("the tangent is factorised"), std::string::npos) << result;
    EXPECT_NE(result.output.find("fields are the same"), std::string::npos) << result;
  }
}

TEST_F(BalloonSolversTest, TheCountOfIterationsFollowsFromTheEndOfNewtonsMethod) {
  const std::string all = "all";
  const auto iterations = [&](const Arguments& choice) {
    succeed(1, Arguments{PELLICLE_SOURCE_DIR "/input/vase.yaml", "-mesh_vertices", "600", "-time_max_steps", "4",
                         "-output_interval_steps", "20", "-output_directory", all} +
                   choice);
    return read_csv(folder() / all / "history.csv").at("newton_iterations");
  };
  EXPECT_EQ(iterations({}), (std::vector<double>{0, 3, 3, 3, 3})) << "the paper's count";
  const std::vector<double> converged = iterations({"-prism_newton", "converged"});
  EXPECT_GT(*std::max_element(converged.begin(), converged.end()), 3);
  EXPECT_LT(read_csv(folder() / all / "history.csv").at("relative_residual").back(), 1e-7);
  EXPECT_EQ(iterations({"-prism_snes_max_it", "2"}), (std::vector<double>{0, 2, 2, 2, 2})) << "the user's count";
}

TEST_F(BalloonSolversTest, ThePapersCountOfIterations) {
  run(2, {"-prism_newton", "fixed"});
  EXPECT_EQ(history_.at("newton_iterations"), (std::vector<double>{0, 3, 3, 3}));
}

TEST_F(BalloonSolversTest, MonitorsTell) {
  const CommandResult result = succeed(2, {"scene.yaml", "-time_max_steps", "2", "-prism_snes_monitor",
                                           "-prism_snes_converged_reason", "-prism_ksp_converged_reason"});
  const auto history = read_csv(folder() / "out" / "history.csv");
  const double newton = history.at("newton_iterations")[1] + history.at("newton_iterations")[2];
  EXPECT_EQ(count(result.output, "SNES Function norm"), newton + 2) << result;
  EXPECT_EQ(count(result.output, "Linear prism_ solve converged due to"), newton) << result;
  EXPECT_EQ(count(result.output, "Nonlinear prism_ solve converged due to"), 2) << result;
}

TEST_F(BalloonSolversTest, OptionsThatNothingUsedAreWarnedAbout) {
  const CommandResult result =
      succeed(2, {"scene.yaml", "-time_max_steps", "1", "-prism_ksp_rtoll", "1e-3", "-prism_snes_monitr"});
  EXPECT_EQ(result.error_lines().size(), 2U) << result;
  for (const char* name : {"-prism_ksp_rtoll", "-prism_snes_monitr"}) {
    EXPECT_NE(result.errors.find(name), std::string::npos) << name << "\n" << result;
  }
}

TEST_F(BalloonSolversTest, ASolverThatStopsTooEarlyIsAFailureWithItsReason) {
  const CommandResult result = pellicle(2, {"scene.yaml", "-prism_ksp_max_it", "1", "-time_max_retries", "1"});
  EXPECT_EQ(result.exit_code, 1) << result;
  ASSERT_EQ(result.error_lines().size(), 1U) << result;
  for (const char* text : {"step 1", "prism_", "DIVERGED_ITS"}) {
    EXPECT_NE(result.errors.find(text), std::string::npos) << text << "\n" << result;
  }
  EXPECT_EQ(read_pvd(folder() / "out" / "scene.pvd").size(), 1U) << "the state before the failure is the last frame";
}

}  // namespace
}  // namespace pellicle
