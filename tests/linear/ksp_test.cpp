#include "linear/ksp.h"

#include <gtest/gtest.h>

#include <cmath>
#include <csignal>

#include "base/error.h"
#include "base/stop_signal.h"
#include "linear/own_preconditioner.h"
#include "tests/linear/chain_matrix.h"
#include "tests/support/solver_options.h"

namespace pellicle {
namespace {

/// A chain with a right-hand side of ones.
struct Chain {
  static constexpr PetscInt size = 40;

  explicit Chain(double beside = -1) : matrix(chain_matrix(size, beside)) {
    check(MatCreateVecs(matrix, x.create(), b.create()));
    check(VecSet(b, 1));
  }

  /// With options, given without their prefix "chain_".
  LinearResult solve(const std::vector<std::pair<std::string, std::string>>& given, const LinearNeed* need = nullptr) {
    SolverOptions options;
    for (const auto& [name, value] : given) {
      options.set("chain_" + name, value);
    }
    const KspHandle ksp = make_ksp(matrix, matrix, "chain_", {KSPCG, PCBJACOBI, 1e-10});
    return pellicle::solve(ksp, b, x, need);
  }

  double residual() const {
    VecHandle left;
    double norm = 0;
    check(VecDuplicate(b, left.create()));
    check(MatMult(matrix, x, left));
    check(VecAXPY(left, -1, b));
    check(VecNorm(left, NORM_2, &norm));
    return norm;
  }

  MatHandle matrix;
  VecHandle x;
  VecHandle b;
};

TEST(Ksp, AFactorisationAloneSolves) {
  Chain chain;
  const LinearResult result =
      chain.solve({{"ksp_type", "preonly"}, {"pc_type", "lu"}, {"pc_factor_mat_solver_type", "mumps"}});
  EXPECT_TRUE(result.converged) << result.reason;
  EXPECT_LT(chain.residual(), 1e-10);
}

TEST(Ksp, WhatTestsNoResidualIsTested) {
  const std::vector<std::vector<std::pair<std::string, std::string>>> untested{
      {{"ksp_type", "preonly"}, {"pc_type", "jacobi"}},
      {{"ksp_convergence_test", "skip"}, {"ksp_max_it", "3"}, {"pc_type", "jacobi"}},
      {{"ksp_type", "richardson"}, {"pc_type", "sor"}, {"ksp_norm_type", "none"}, {"ksp_max_it", "2"}}};
  for (const auto& options : untested) {
    Chain chain;
    const LinearResult result = chain.solve(options);
    EXPECT_GT(chain.residual(), 0.01) << "or there is nothing to find";
    EXPECT_FALSE(result.converged) << options.front().second;
  }
  Chain chain;
  EXPECT_NE(chain.solve(untested.front()).reason.find("chain_ (preonly) does not solve"), std::string::npos);
}

TEST(Ksp, ADirectionOfNegativeCurvatureIsNoSolution) {
  for (const char* type : {"cg", "stcg"}) {
    Chain chain(-2);
    const LinearResult result = chain.solve({{"ksp_type", type}, {"pc_type", "none"}});
    EXPECT_FALSE(result.converged) << type;
  }
}

TEST(Ksp, WhatGrowsBeyondAllNumbersCanBeSolvedAgain) {
  Chain chain;
  SolverOptions options;
  options.set("chain_ksp_type", "chebyshev");
  options.set("chain_ksp_chebyshev_eigenvalues", "0.1,0.2");  // far less than the largest
  options.set("chain_ksp_divtol", "1e308");
  const KspHandle ksp = make_ksp(chain.matrix, chain.matrix, "chain_", {});
  for (int time = 0; time < 5; ++time) {
    EXPECT_EQ(solve(ksp, chain.b, chain.x).ended, KSP_DIVERGED_NANORINF) << time;
  }
}

/// Sends a signal to the last rank in an iteration of a solver.
PetscErrorCode raise_signal(KSP, PetscInt iteration, PetscReal, void* at) {
  if (iteration == *static_cast<PetscInt*>(at) && this_rank() == ranks() - 1) {
    std::raise(SIGUSR1);
  }
  return 0;
}

TEST(Ksp, ASolveIsLeftAtASignal) {
  catch_stop_signals(0);
  for (const auto& [type, norm] : {std::pair{"richardson", "preconditioned"},
                                   {"richardson", "none"},
                                   {"chebyshev", "preconditioned"},
                                   {"cg", "natural"},
                                   {"minres", "preconditioned"},
                                   {"gmres", "preconditioned"},
                                   {"bcgs", "preconditioned"},
                                   {"pipecg", "natural"}}) {
    Chain chain;
    SolverOptions options;
    options.set("chain_ksp_type", type);
    options.set("chain_ksp_norm_type", norm);
    options.set("chain_ksp_rtol", "1e-300");
    options.set("chain_ksp_max_it", "1000000");
    options.set("chain_ksp_error_if_not_converged", "true");
    options.set("chain_ksp_richardson_scale", "1e-9");  // It never comes to an end.
    options.set("chain_ksp_chebyshev_eigenvalues", "0.1,100");
    options.set("chain_pc_type", "none");
    const KspHandle ksp = make_ksp(chain.matrix, chain.matrix, "chain_", {});
    for (PetscInt iteration : {0, 5}) {
      const std::string what = std::string(type) + ", " + norm + ", iteration " + std::to_string(iteration);
      defer_stop_signals();
      check(KSPMonitorCancel(ksp));
      check(KSPMonitorSet(ksp, raise_signal, &iteration, nullptr));
      EXPECT_EQ(until_stopped(PETSC_COMM_WORLD, [&] { solve(ksp, chain.b, chain.x); }), SIGUSR1) << what;
      PetscInt iterations = 0;
      check(KSPGetIterationNumber(ksp, &iterations));
      EXPECT_LE(iterations, iteration + 64) << what;
      check(KSPMonitorCancel(ksp));
      EXPECT_EQ(until_stopped(PETSC_COMM_WORLD, [&] { solve(ksp, chain.b, chain.x); }), SIGUSR1)
          << "before the solve, " << what;
    }
  }
  defer_stop_signals();
}

TEST(Ksp, AnAbsoluteToleranceIsJudgedByWhatIsNeeded) {
  const LinearNeed need{0.1, 0};
  const LinearNeed less_than_all{0.1, 2 * std::sqrt(Chain::size)};
  for (const char* type : {"cg", "gmres"}) {
    const std::vector<std::pair<std::string, std::string>> absurd{{"ksp_type", type}, {"ksp_atol", "1e20"}};
    Chain chain;
    const LinearResult result = chain.solve(absurd, &need);
    EXPECT_FALSE(result.converged) << type;
    EXPECT_EQ(result.reason, std::string("the linear solver chain_ (") + type +
                                 ") does not solve: it leaves 1.0e+00 of the right-hand side, more than 1.0e-01");
    EXPECT_TRUE(chain.solve(absurd).converged) << "where its use is judged";
    EXPECT_TRUE(chain.solve(absurd, &less_than_all).converged);
    EXPECT_TRUE(chain.solve({{"ksp_type", type}, {"ksp_atol", "1e-3"}}, &need).converged);
    EXPECT_LT(chain.residual(), 0.1 * std::sqrt(Chain::size));
  }
}

TEST(Ksp, ARelativeToleranceThatIsNoneIsRefused) {
  const auto said = [](const std::string& rtol, double largest) -> std::string {
    SolverOptions options;
    options.set("chain_ksp_rtol", rtol);
    KspDefaults defaults;
    defaults.largest_rtol = largest;
    Chain chain;
    try {
      make_ksp(chain.matrix, chain.matrix, "chain_", defaults);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(said("0.5", 0.1), "-chain_ksp_rtol 0.5: leaves too much of the system unsolved, expected at most 0.1");
  EXPECT_EQ(said("0.1", 0.1), "");
  EXPECT_EQ(said("0.9", 1), "");
  for (const char* rtol : {"1", "nan", "-1"}) {
    EXPECT_EQ(said(rtol, 1).find("-chain_"), 0U) << rtol << ": " << said(rtol, 1);
  }
}

/// What make_ksp says to an option.
std::string refusal(const std::string& prefix, const std::vector<std::pair<std::string, std::string>>& given) {
  SolverOptions options;
  for (const auto& [name, value] : given) {
    options.set(name, value);
  }
  Chain chain;
  try {
    make_ksp(chain.matrix, chain.matrix, prefix, {});
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Ksp, RefusalsNameWhatWasGivenAndWhatIsWrongWithIt) {
  EXPECT_EQ(refusal("chain_", {{"chain_pc_type", "jacoby"}}),
            "-chain_pc_type jacoby: this PETSc has no such preconditioner, nearest: jacobi");
  const std::string missing =
      refusal("chain_", {{"chain_pc_type", "lu"}, {"chain_pc_factor_mat_solver_type", "strumpack"}});
  EXPECT_EQ(missing.find("-chain_pc_factor_mat_solver_type strumpack: this PETSc has no such solver package"), 0U)
      << missing;
  const std::string other =
      refusal("chain_", {{"chain_pc_type", "cholesky"}, {"chain_pc_factor_mat_solver_type", "umfpack"}});
  EXPECT_EQ(other.find("-chain_pc_factor_mat_solver_type umfpack: this package has no cholesky for a matrix"), 0U)
      << other;
  EXPECT_EQ(refusal("chain_", {{"chain_pc_type", "fieldsplit"}}).find("-chain_pc_type fieldsplit: the unknowns are"),
            0U);
  EXPECT_EQ(refusal("chain_", {{"chain_ksp_diagonal_scale", "1"}}).find("-chain_ksp_diagonal_scale: leaves the matrix"),
            0U);
  EXPECT_EQ(refusal("chain_", {{"chain_ksp_diagonal_scale", "1"}, {"chain_ksp_diagonal_scale_fix", "1"}}), "");
  // Of a general prefix what was given is named, not the variant that it was handed to.
  EXPECT_EQ(refusal("chain_red_", {{"chain_pc_type", "bddc"}, {"chain_red_pc_type", "bddc"}}).find("-chain_pc_type"),
            0U);
  EXPECT_EQ(refusal("chain_red_", {{"chain_pc_type", "icc"}, {"chain_red_pc_type", "bddc"}}).find("-chain_red_pc_type"),
            0U);
}

TEST(Ksp, NothingIsPutAmongTheUsersOptions) {
  for (const char* type : {"icc", "ilu"}) {  // which are blocks of block Jacobi on several ranks
    Chain chain;
    SolverOptions options;
    options.set("chain_pc_type", type);
    const KspHandle ksp = make_ksp(chain.matrix, chain.matrix, "chain_", {KSPCG, PCNONE, 1e-10});
    const LinearResult result = solve(ksp, chain.b, chain.x);
    EXPECT_TRUE(result.converged) << result.reason;
    if (ranks() > 1) {
      PC pc = nullptr;
      KSP* blocks = nullptr;
      PCType block_type = nullptr;
      check(KSPGetPC(ksp, &pc));
      check(PCBJacobiGetSubKSP(pc, nullptr, nullptr, &blocks));
      check(KSPGetPC(blocks[0], &pc));
      check(PCGetType(pc, &block_type));
      EXPECT_STREQ(block_type, type);
    }
    char* all = nullptr;
    check(PetscOptionsGetAll(nullptr, &all));
    EXPECT_EQ(std::string(all), std::string("-chain_pc_type ") + type + " ");
    check(PetscFree(all));
  }
}

TEST(Ksp, AMatrixOffersAPreconditionerOfItsOwn) {
  Chain chain;
  chain.solve({{"pc_type", "jacobi"}});
  int updates = 0;
  const OwnPreconditioner halves{[&updates] { ++updates; },
                                 [](Vec in, Vec out) {
                                   check(VecCopy(in, out));
                                   check(VecScale(out, 0.5));
                                 },
                                 "halves"};
  offer_preconditioner(chain.matrix, "halves", halves);
  const int expected = chain.solve({{"pc_type", "jacobi"}}).iterations;
  for (const char* type : {"cg", "minres", "gmres"}) {
    const LinearResult result = chain.solve({{"ksp_type", type}, {"pc_type", "halves"}});
    EXPECT_TRUE(result.converged) << result.reason;
    EXPECT_LT(chain.residual(), 1e-6) << type;
    if (std::string(type) == "cg") {
      EXPECT_EQ(result.iterations, expected) << "it is Jacobi's here";
    }
  }
  EXPECT_EQ(updates, 3);
  EXPECT_EQ(refusal("chain_", {{"chain_pc_type", "halves"}}),
            "-chain_pc_type halves: the matrix has nothing that it could use, expected another preconditioner");
}

TEST(Ksp, AMatrixOfAnyTypeIsDefiniteForGood) {
  for (const char* type : {MATAIJ, MATBAIJ, MATSBAIJ, MATSELL}) {
    MatHandle matrix;
    PetscBool is_set = PETSC_FALSE;
    PetscBool is_definite = PETSC_FALSE;
    check(MatCreate(PETSC_COMM_WORLD, matrix.create()));
    check(MatSetSizes(matrix, 2, 2, PETSC_DETERMINE, PETSC_DETERMINE));
    check(MatSetType(matrix, type));
    check(MatSetUp(matrix));
    set_definite(matrix);
    PetscInt first = 0;
    PetscInt end = 0;
    check(MatGetOwnershipRange(matrix, &first, &end));
    for (PetscInt i = first; i < end; ++i) {
      check(MatSetValue(matrix, i, i, 1, INSERT_VALUES));
    }
    check(MatAssemblyBegin(matrix, MAT_FINAL_ASSEMBLY));
    check(MatAssemblyEnd(matrix, MAT_FINAL_ASSEMBLY));
    check(MatIsSymmetricKnown(matrix, &is_set, &is_definite));
    EXPECT_TRUE(is_set == PETSC_TRUE && is_definite == PETSC_TRUE) << type;
  }
}

TEST(Ksp, ATypeOfMatrixIsNoOptionOfPetscs) {
  Chain chain;
  SolverOptions options;
  options.set("chain_mat_type", "sell");
  EXPECT_THROW(set_matrix_options(chain.matrix, "chain_"), Error);
}

TEST(Ksp, WhatPetscRefusesInTheSolveIsTheOptionsFault) {
  Chain chain;
  keep_petsc_messages();  // as the program does; PETSc's own handler ends every rank but the first
  try {
    chain.solve({{"pc_type", "composite"}});
    ADD_FAILURE() << "solved";
  } catch (const Error& error) {
    EXPECT_EQ(std::string(error.what()).find("-chain_pc_type composite: PETSc: "), 0U) << error.what();
  }
  check(PetscPopErrorHandler());
}

}  // namespace
}  // namespace pellicle
