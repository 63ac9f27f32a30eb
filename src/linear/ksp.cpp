#include "linear/ksp.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <iterator>
#include <limits>
#include <memory>

#include "base/error.h"
#include "base/stop_signal.h"
#include "base/units.h"
#include "linear/named_fields.h"
#include "linear/own_preconditioner.h"
#include "linear/saved_system.h"
#include "options/spelling.h"

namespace pellicle::linear {

namespace {

/// Whether a type is one of some.
bool is(const char* type, std::initializer_list<const char*> names) {
  return type != nullptr &&
         std::any_of(names.begin(), names.end(), [type](const char* name) { return std::strcmp(type, name) == 0; });
}

/// Name of an option as the user wrote it: options of the prefix "project_" are copied to "project_red_", and in a run
/// of several objects to "objects_cloth_project_red_".
std::string given_name(const std::string& prefix, const std::string& option) {
  const std::string own = "-" + prefix + option;
  const std::optional<std::string> value = option_value(own);
  std::vector<std::size_t> words{0};  // where each begins
  for (std::size_t at = prefix.find('_'); at != std::string::npos; at = prefix.find('_', at + 1)) {
    words.push_back(at + 1);
  }
  for (std::size_t count = 1; count < words.size(); ++count) {
    for (std::size_t first = 0; first + count < words.size(); ++first) {
      const std::string part = "-" + prefix.substr(words[first], words[first + count] - words[first]) + option;
      if (value && option_value(part) == value) {
        return part;
      }
    }
  }
  return own;
}

/// The solver and preconditioner of `prefix` as the user chose them, for a message.
std::string chosen_solver(const std::string& prefix) {
  std::string words;
  for (const char* option : {"ksp_type", "pc_type"}) {
    if (const std::optional<std::string> value = option_value("-" + prefix + option)) {
      words += (words.empty() ? "" : ", ") + given_name(prefix, option) + " " + *value;
    }
  }
  return words.empty() ? "-" + prefix + "..." : words;
}

/// @throws Error that names the options of `prefix`, if they ask for something impossible; every rank then has the same
/// error
void throw_if_about_options(const std::string& prefix, const PetscFailure& failure) {
  // PETSC_ERR_NOT_CONVERGED comes of -ksp_error_if_not_converged.
  for (const PetscErrorCode code :
       {PETSC_ERR_SUP, PETSC_ERR_ORDER, PETSC_ERR_USER, PETSC_ERR_USER_INPUT, PETSC_ERR_MISSING_FACTOR,
        PETSC_ERR_ARG_WRONG, PETSC_ERR_ARG_WRONGSTATE, PETSC_ERR_ARG_OUTOFRANGE, PETSC_ERR_ARG_INCOMP,
        PETSC_ERR_ARG_NULL, PETSC_ERR_ARG_SIZ, PETSC_ERR_ARG_UNKNOWN_TYPE, PETSC_ERR_ARG_TYPENOTSET,
        PETSC_ERR_WRONG_MPI_SIZE, PETSC_ERR_NOT_CONVERGED}) {
    if (failure.code() == code) {
      throw Error(chosen_solver(prefix) + ": " + failure.what());
    }
  }
}

/// Refuses a type that PETSc does not have. @param kind of the types, in words
void require_known(const std::string& prefix, const std::string& option, const char* kind, PetscFunctionList list) {
  const std::optional<std::string> value = option_value("-" + prefix + option);
  if (!value) {
    return;
  }
  const char** names = nullptr;
  int count = 0;
  check(PetscFunctionListGet(list, &names, &count));
  std::vector<std::string> known;
  for (int i = 0; i < count; ++i) {
    if (names[i] != nullptr) {  // of a type that was taken back
      known.emplace_back(names[i]);
    }
  }
  check(PetscFree(names));
  if (std::find(known.begin(), known.end(), *value) == known.end()) {
    throw Error(given_name(prefix, option) + " " + *value + ": this PETSc has no such " + kind +
                ", nearest: " + nearest(*value, known));
  }
}

/// Refuses a factorisation that no package, or not the chosen one, has for the matrix. Called before PETSc reads the
/// options, because its message names neither.
void require_factor(const std::string& prefix, Mat matrix) {
  const std::string type = option_value("-" + prefix + "pc_type").value_or("");
  if (type != PCLU && type != PCCHOLESKY) {
    return;
  }
  const MatType matrix_type = type_of(matrix);
  const std::optional<std::string> chosen = option_value("-" + prefix + "pc_factor_mat_solver_type");
  MatSolverType package = chosen ? chosen->c_str() : nullptr;
  const MatFactorType factor = type == PCLU ? MAT_FACTOR_LU : MAT_FACTOR_CHOLESKY;
  PetscBool is_there = PETSC_FALSE;
  check(MatGetFactorAvailable(matrix, package, factor, &is_there));
  if (is_there == PETSC_TRUE) {
    return;
  }
  const auto has = [&](MatSolverType name, bool for_matrix) {
    PetscBool has_package = PETSC_FALSE;
    PetscBool has_matrix = PETSC_FALSE;
    check(MatSolverTypeGet(name, matrix_type, factor, &has_package, &has_matrix, nullptr));
    return (for_matrix ? has_matrix : has_package) == PETSC_TRUE;
  };
  std::string expected;
  for (MatSolverType name :
       {MATSOLVERPETSC, MATSOLVERMUMPS, MATSOLVERSUPERLU, MATSOLVERSUPERLU_DIST, MATSOLVERUMFPACK, MATSOLVERKLU,
        MATSOLVERCHOLMOD, MATSOLVERSTRUMPACK, MATSOLVERPASTIX, MATSOLVERMKL_PARDISO, MATSOLVERMKL_CPARDISO}) {
    if (has(name, true)) {
      expected += (expected.empty() ? "" : " or ") + std::string(name);
    }
  }
  expected = expected.empty() ? "another preconditioner or type of matrix"
                              : given_name(prefix, "pc_factor_mat_solver_type") + " " + expected;
  if (package == nullptr) {
    throw Error(given_name(prefix, "pc_type") + " " + type + ": no package has one for a matrix of type " +
                matrix_type + ", expected " + expected);
  }
  const std::string fault = has(package, false)
                                ? std::string("this package has no ") + type + " for a matrix of type " + matrix_type
                                : "this PETSc has no such solver package";
  throw Error(given_name(prefix, "pc_factor_mat_solver_type") + " " + package + ": " + fault + ", expected " +
              expected);
}

/// Sets the type of block Jacobi's blocks, then the user's options for them.
void set_blocks(KSP ksp, PCType type) {
  KSP* blocks = nullptr;
  PetscInt count = 0;
  check(KSPSetUp(ksp));
  check(PCBJacobiGetSubKSP(preconditioner_of(ksp), &count, nullptr, &blocks));
  for (PetscInt block = 0; block < count; ++block) {
    check(PCSetType(preconditioner_of(blocks[block]), type));
    check(KSPSetFromOptions(blocks[block]));
  }
}

/// Gives MUMPS additional memory where it factorises, unless the user says how much.
void give_mumps_room(KSP ksp) {
  const PC pc = preconditioner_of(ksp);
  MatSolverType package = nullptr;
  Mat factor = nullptr;
  if (!has_type(pc, {PCLU, PCCHOLESKY})) {
    return;
  }
  check(PCFactorGetMatSolverType(pc, &package));
  if (is(package, {MATSOLVERMUMPS}) &&
      !option_value("-" + prefix_of(ksp) + "mat_mumps_icntl_" + std::to_string(mumps_room_setting))) {
    check(PCFactorSetUpMatSolverType(pc));
    check(PCFactorGetMatrix(pc, &factor));
    check(MatMumpsSetIcntl(factor, mumps_room_setting, mumps_room));
  }
}

bool has_operation(Mat matrix, MatOperation operation) {
  PetscBool is_there = PETSC_FALSE;
  check(MatHasOperation(matrix, operation, &is_there));
  return is_there == PETSC_TRUE;
}

/// Refuses preconditioners that PETSc refuses only in the first solve, and those that crash or do nothing.
/// @param type of the preconditioner @param matrix from which it is made
void require_available(PCType type, Mat system, Mat matrix, const std::string& prefix) {
  bool is_there = true;
  const std::string option = given_name(prefix, "pc_type") + " " + type;
  std::string wanted = "another preconditioner or type of matrix";
  if (is(type, {PCPBJACOBI})) {
    is_there = has_operation(matrix, MATOP_INVERT_BLOCK_DIAGONAL);
  } else if (is(type, {PCGAMG, PCML, PCFIELDSPLIT})) {
    is_there = has_type(matrix, {MATSEQAIJ, MATMPIAIJ});
    wanted = "type aij";
    PetscInt block_size = 1;
    check(MatGetBlockSize(matrix, &block_size));
    if (is(type, {PCFIELDSPLIT}) && block_size == 1) {
      throw Error(option +
                  ": the unknowns are of one kind, there is nothing to split, expected another preconditioner");
    }
  } else if (is(type, {PCSOR, PCILU})) {
    is_there = !has_type(matrix, {MATSEQSBAIJ, MATMPISBAIJ});
  } else if (is(type, {PCEISENSTAT}) && system != matrix) {
    throw Error(option +
                ": the system has a part that the preconditioner's matrix lacks, expected another preconditioner");
  } else if (is(type, {PCEXOTIC, PCREDISTRIBUTE, PCLMVM, PCPATCH, PCSHELL, PCGALERKIN, PCCP, PCVPBJACOBI, PCBDDC, PCNN,
                       PCDEFLATION, PCTFS, PCLSC})) {
    throw Error(option + ": this preconditioner needs more than a matrix, expected another preconditioner");
  }
  if (!is_there) {
    throw Error(option + ": PETSc has none for a matrix of type " + type_of(matrix) + ", expected " + wanted);
  }
}

/// A reason for which PETSc ends a solve without success, and its meaning for the system that was to be solved. The
/// words explain a reason whose name in PETSc is not clear by itself; {} stands for the preconditioner's type.
struct Failure {
  KSPConvergedReason reason;
  Solved solved;
  const char* words;
};
constexpr Failure failures[] = {
    {KSP_DIVERGED_INDEFINITE_PC, Solved::bad_preconditioner, ": the preconditioner {} is not positive definite"},
    {KSP_DIVERGED_INDEFINITE_MAT, Solved::concave, ": the matrix is not positive definite"},
    {KSP_CONVERGED_CG_NEG_CURVE, Solved::concave, ""},
    {KSP_DIVERGED_PC_FAILED, Solved::bad_preconditioner, ": the preconditioner {} could not be made"},
    {KSP_DIVERGED_NANORINF, Solved::no, ": a value is not finite"}};

/// Marks the result of a solve that did not converge.
void refuse(LinearResult& result, KSP ksp) {
  const PCType type = type_of(preconditioner_of(ksp));
  const auto* failure = std::find_if(std::begin(failures), std::end(failures),
                                     [&](const Failure& known) { return known.reason == result.ended; });
  const Failure found = failure != std::end(failures) ? *failure : Failure{result.ended, Solved::no, ""};
  result.refuse(found.solved, fmt::format("the linear solver {} did not converge ({} after {} iterations{})",
                                          prefix_of(ksp), KSPConvergedReasons[result.ended], result.iterations,
                                          fmt::format(fmt::runtime(found.words), type != nullptr ? type : "")));
}

/// PETSc scales the matrix itself, which is used between the solves too, and can't scale one without entries.
void require_unscaled(KSP ksp, Mat matrix, const std::string& prefix) {
  PetscBool scales = PETSC_FALSE;
  PetscBool scales_back = PETSC_FALSE;
  check(KSPGetDiagonalScale(ksp, &scales));
  check(KSPGetDiagonalScaleFix(ksp, &scales_back));
  if (scales == PETSC_TRUE && has_type(matrix, {MATSHELL})) {
    throw Error(given_name(prefix, "ksp_diagonal_scale") + ": the operator has no entries, expected pc_type jacobi");
  }
  if (scales == PETSC_TRUE && scales_back == PETSC_FALSE) {
    throw Error(given_name(prefix, "ksp_diagonal_scale") +
                ": leaves the matrix scaled, expected also ksp_diagonal_scale_fix, or pc_type jacobi alone");
  }
}

/// Refuses a relative tolerance that would leave the system unsolved, or is none.
void require_tolerance(KSP ksp, const std::string& prefix, double largest) {
  double rtol = 0;
  check(KSPGetTolerances(ksp, &rtol, nullptr, nullptr, nullptr));
  const std::string given = given_name(prefix, "ksp_rtol") + " " + number_text(rtol) + ": ";
  if (!(rtol >= 0)) {
    throw Error(given + "no tolerance, expected at least 0");
  }
  if (rtol >= 1 || rtol > largest) {
    throw Error(given + "leaves too much of the system unsolved, expected " +
                (largest < 1 ? "at most " + number_text(largest) : "less than 1"));
  }
}

/// Repairs KSPCHEBYSHEV after a solve with numbers that are not finite: one of its work vectors is then its solution,
/// without a reference, and the next solve would free and use it. Gives it a reference, and takes one from the
/// solution.
void own_solution(KSP ksp, Vec solution) {
  Vec left = nullptr;
  check(KSPGetSolution(ksp, &left));
  if (left != solution) {
    check(PetscObjectReference(reinterpret_cast<PetscObject>(left)));
    check(VecDestroy(&solution));
  }
}

/// A solver's own convergence test, with a StopPoint.
struct StoppableTest {
  PetscErrorCode (*test)(KSP, PetscInt, PetscReal, KSPConvergedReason*, void*) = nullptr;
  void* context = nullptr;
  PetscErrorCode (*destroy)(void*) = nullptr;
  StopPoint stop;
  PCType block_type = nullptr;  ///< of block Jacobi's blocks, until they are made; null: as the options say
};

PetscErrorCode test_or_stop(KSP ksp, PetscInt iteration, PetscReal norm, KSPConvergedReason* reason, void* context) {
  return as_petsc_callback([&] {
    auto& own = *static_cast<StoppableTest*>(context);
    check(own.test(ksp, iteration, norm, reason, own.context));
    if (*reason == KSP_CONVERGED_ITERATING && own.stop.pass()) {
      *reason = KSP_CONVERGED_ITS;  // No failure, which could become an error of PETSc's; `solve` leaves off.
    }
  });
}

PetscErrorCode destroy_test(void* context) {
  return as_petsc_callback([&] {
    const std::unique_ptr<StoppableTest> own(static_cast<StoppableTest*>(context));
    if (own->destroy != nullptr) {
      check(own->destroy(own->context));
    }
  });
}

/// The test of a solver that make_stoppable has got, or null.
StoppableTest* stoppable_test(KSP ksp) {
  PetscErrorCode (*test)(KSP, PetscInt, PetscReal, KSPConvergedReason*, void*) = nullptr;
  void* context = nullptr;
  check(KSPGetConvergenceTest(ksp, &test, &context, nullptr));
  return test == test_or_stop ? static_cast<StoppableTest*>(context) : nullptr;
}

}  // namespace

void make_stoppable(KSP ksp) {
  auto own = std::make_unique<StoppableTest>();
  check(KSPGetAndClearConvergenceTest(ksp, &own->test, &own->context, &own->destroy));
  check(KSPSetConvergenceTest(ksp, test_or_stop, own.release(), destroy_test));
}

std::string prefix_of(KSP ksp) {
  const char* prefix = nullptr;
  check(KSPGetOptionsPrefix(ksp, &prefix));
  return prefix != nullptr ? prefix : "";
}

std::optional<std::string> option_value(const std::string& name) {
  char text[PETSC_MAX_PATH_LEN];
  PetscBool is_set = PETSC_FALSE;
  check(PetscOptionsGetString(nullptr, nullptr, name.c_str(), text, sizeof text, &is_set));
  return is_set == PETSC_TRUE ? std::optional<std::string>(text) : std::nullopt;
}

void run_solver(const std::string& prefix, const std::function<void()>& calls) {
  try {
    calls();
  } catch (const PetscFailure& failure) {
    throw_if_about_options(prefix, failure);
    throw;
  }
}

bool any_is_given(const std::string& prefix, std::initializer_list<const char*> names) {
  return std::any_of(names.begin(), names.end(),
                     [&prefix](const char* name) { return option_value("-" + prefix + name).has_value(); });
}

bool asks_for_entries(const std::string& prefix) {
  const std::string preconditioner = option_value("-" + prefix + "pc_type").value_or(PCJACOBI);
  return (preconditioner != PCJACOBI && preconditioner != PCNONE) ||
         any_is_given(prefix, {"pc_jacobi_type", "ksp_diagonal_scale", "ksp_view_mat", "mat_view", "save_system"});
}

void set_definite(Mat matrix) {
  const bool lacks_option = has_type(matrix, {MATMPIBAIJ, MATMPISBAIJ});  // in PETSc 3.18, which refuses it
  check(MatSetOption(matrix, lacks_option ? MAT_SYMMETRIC : MAT_SPD, PETSC_TRUE));
  check(MatSetOption(matrix, lacks_option ? MAT_SYMMETRY_ETERNAL : MAT_SPD_ETERNAL, PETSC_TRUE));
}

void set_matrix_options(Mat matrix, const std::string& prefix) {
  if (const std::optional<std::string> type = option_value("-" + prefix + "mat_type")) {
    throw Error(given_name(prefix, "mat_type") + " " + *type + ": the matrix is made as type " + type_of(matrix) +
                ", expected the option mat_type of its section");
  }
  check(MatSetOptionsPrefix(matrix, prefix.c_str()));
  check(MatSetFromOptions(matrix));
}

KspHandle make_ksp(Mat matrix, Mat preconditioning, const std::string& prefix, const KspDefaults& defaults) {
  KspHandle ksp;
  check(KSPCreate(comm_of(matrix), ksp.create()));
  check(KSPSetOptionsPrefix(ksp, prefix.c_str()));
  check(KSPSetOperators(ksp, matrix, preconditioning));
  check(KSPSetType(ksp, defaults.type));
  check(KSPSetTolerances(ksp, defaults.rtol, PETSC_DEFAULT, defaults.divtol, defaults.max_iterations));
  check(KSPCGUseSingleReduction(ksp, defaults.single_reduction ? PETSC_TRUE : PETSC_FALSE));
  const PC pc = preconditioner_of(ksp);
  const bool matrix_free = has_type(preconditioning, {MATSHELL});
  const bool has_blocks = has_operation(preconditioning, MATOP_INVERT_BLOCK_DIAGONAL);  // of its diagonal
  // A shell with blocks is a tangent; for a tangent rigid patches can be a level.
  const auto has_matrix_free = [&](PCType type) {
    return is_own_type(type) ? offers_preconditioner(preconditioning, type)
                             : is(type, {PCNONE, PCJACOBI}) || (has_blocks && is(type, {PCPBJACOBI, PCMG}));
  };
  const PCType matrix_free_default = has_blocks ? PCPBJACOBI : PCJACOBI;
  check(PCSetType(
      pc, matrix_free && !has_matrix_free(defaults.preconditioner) ? matrix_free_default : defaults.preconditioner));
  check(KSPInitializePackage());
  check(PCInitializePackage());
  require_known(prefix, "ksp_type", "linear solver", KSPList);
  require_known(prefix, "pc_type", "preconditioner", PCList);
  if (!matrix_free) {
    require_factor(prefix, preconditioning);
  }
  const DmHandle dm = make_dm(preconditioning, prefix, {defaults.fields, "", 0});
  check(KSPSetDM(ksp, dm));
  check(KSPSetDMActive(ksp, PETSC_FALSE));  // The matrices are ours.
  run_solver(prefix, [&] { check(KSPSetFromOptions(ksp)); });

  require_unscaled(ksp, matrix, prefix);
  require_tolerance(ksp, prefix, defaults.largest_rtol);

  const PCType type = type_of(pc);
  if (is_own_type(type) && !offers_preconditioner(preconditioning, type)) {
    throw Error(given_name(prefix, "pc_type") + " " + type +
                ": the matrix has nothing that it could use, expected another preconditioner");
  }
  if (matrix_free && !has_matrix_free(type)) {
    throw Error(given_name(prefix, "pc_type") + " " + type +
                ": a matrix-free operator has only its diagonal, expected " +
                (has_blocks ? "mg, none, pbjacobi" : "none") + " or jacobi");
  }
  if (!any_is_given(prefix, {"pc_use_amat"}) && !is(type, {PCMG, PCGAMG, PCML})) {
    check(PCSetUseAmat(pc, PETSC_FALSE));  // Multigrid sets it, and leaves it to a type chosen in its place.
  }
  // PETSc's default, the restricted kind, is not symmetric, as conjugate gradients need it.
  if (is(type, {PCASM}) && !option_value("-" + prefix + "pc_asm_type")) {
    check(PCASMSetType(pc, PC_ASM_BASIC));
  }
  if (is(type, {PCFIELDSPLIT}) && !option_value("-" + prefix + "pc_fieldsplit_type")) {  // Likewise.
    check(PCFieldSplitSetType(pc, PC_COMPOSITE_SYMMETRIC_MULTIPLICATIVE));
  }
  if (!matrix_free) {
    require_available(type, matrix, preconditioning, prefix);
  }
  save_systems(ksp, prefix);
  make_stoppable(ksp);
  if (ranks_of(comm_of(matrix)) > 1 && is(type, {PCICC, PCILU})) {  // PETSc has them for one rank only.
    stoppable_test(ksp)->block_type = is(type, {PCILU}) ? PCILU : PCICC;
    check(PCSetType(pc, PCBJACOBI));
  }
  return ksp;
}

std::string fault_of_solution(Mat matrix, Mat preconditioning, Vec right_hand_side, Vec solution,
                              const LinearNeed& need) {
  VecHandle work;
  double size = 0;
  double wanted = 0;
  double reached = 0;
  double left = 0;
  check(VecDuplicate(right_hand_side, work.create()));
  if (has_operation(preconditioning, MATOP_GET_DIAGONAL)) {
    check(MatGetDiagonal(preconditioning, work));
    check(VecNorm(work, NORM_INFINITY, &size));
  }
  check(VecNorm(right_hand_side, NORM_2, &wanted));
  check(VecNorm(solution, NORM_2, &reached));
  check(MatMult(matrix, solution, work));
  check(VecAYPX(work, -1, right_hand_side));
  check(VecNorm(work, NORM_2, &left));
  const double rounding = 100 * std::numeric_limits<double>::epsilon() * size * reached;
  const double allowed = std::max(need.relative * wanted, need.absolute);
  if (left <= allowed + rounding) {
    return "";
  }
  return fmt::format("it leaves {:.1e} of the right-hand side, more than {:.1e}", left / wanted, allowed / wanted);
}

LinearResult solve(KSP ksp, Vec right_hand_side, Vec solution, const LinearNeed* need) {
  LinearResult result;
  PetscInt iterations = 0;
  StoppableTest* own = stoppable_test(ksp);
  if (own != nullptr) {
    own->stop.pass();
  }
  leave_if_stopped();  // Making the preconditioner may take long.
  try {
    if (own != nullptr && own->block_type != nullptr) {
      set_blocks(ksp, own->block_type);
      own->block_type = nullptr;
    }
    give_mumps_room(ksp);
    check(KSPSolve(ksp, right_hand_side, solution));
    own_solution(ksp, solution);
    check(KSPGetConvergedReason(ksp, &result.ended));
    check(KSPGetIterationNumber(ksp, &iterations));
  } catch (const PetscFailure& failure) {
    // CHOLMOD's way to say that a matrix is not positive definite
    if (failure.code() != PETSC_ERR_MAT_CH_ZRPVT && failure.code() != PETSC_ERR_MAT_LU_ZRPVT) {
      // Where a call has failed, preconditioners still hold vectors and matrices of their callers as if they were their
      // own (PCMG, PCEISENSTAT), and would destroy them.
      PetscObjectReference(reinterpret_cast<PetscObject>(ksp));
      throw_if_about_options(prefix_of(ksp), failure);
      throw;
    }
    result.ended = KSP_DIVERGED_PC_FAILED;
  }
  leave_if_stopped();
  const KSPConvergedReason reason = result.ended;
  result.iterations = static_cast<int>(iterations);
  // The latter two end the search in a trust region; they are not solutions.
  result.converged = reason > 0 && reason != KSP_CONVERGED_CG_NEG_CURVE && reason != KSP_CONVERGED_CG_CONSTRAINED;
  if (!result.converged) {
    refuse(result, ksp);
  } else if (reason == KSP_CONVERGED_ITS ||  // It has tested nothing: the preconditioner alone, or no norm.
             (need != nullptr && reason != KSP_CONVERGED_RTOL)) {
    Mat matrix = nullptr;
    Mat preconditioning = nullptr;
    double rtol = 0;
    check(KSPGetOperators(ksp, &matrix, &preconditioning));
    check(KSPGetTolerances(ksp, &rtol, nullptr, nullptr, nullptr));
    const LinearNeed needed =
        reason != KSP_CONVERGED_ITS ? *need : LinearNeed{rtol, need != nullptr ? need->absolute : 0};
    const std::string fault = fault_of_solution(matrix, preconditioning, right_hand_side, solution, needed);
    if (!fault.empty()) {
      result.refuse(Solved::no,
                    "the linear solver " + prefix_of(ksp) + " (" + type_of(ksp) + ") does not solve: " + fault);
    }
  }
  return result;
}

}  // namespace pellicle::linear
