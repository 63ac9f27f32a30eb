#include "base/ksp.h"

#include <cstring>

#include "base/error.h"

namespace pellicle {

namespace {

/// Gives a factorisation that PETSc has for one rank only to the blocks of block Jacobi. In the options, since SNES
/// reads those of its KSP again.
void make_parallel(PC pc, const std::string& prefix, const std::string& block_type) {
  const std::string name = "-" + prefix + "sub_pc_type";
  PetscBool is_set = PETSC_FALSE;
  check(PetscOptionsHasName(nullptr, nullptr, name.c_str(), &is_set));
  if (is_set == PETSC_FALSE) {
    check(PetscOptionsSetValue(nullptr, name.c_str(), block_type.c_str()));
  }
  check(PetscOptionsSetValue(nullptr, ("-" + prefix + "pc_type").c_str(), PCBJACOBI));
  check(PCSetFromOptions(pc));
}

bool is(const char* type, const char* name) { return type != nullptr && std::strcmp(type, name) == 0; }

/// Refuses what PETSc would refuse in the first solve only.
/// @param type of the preconditioner @param matrix from which it is made
void require_available(PC pc, PCType type, Mat system, Mat matrix, const std::string& prefix) {
  MatType matrix_type = nullptr;
  PetscBool is_aij = PETSC_FALSE;
  PetscBool is_sbaij = PETSC_FALSE;
  PetscBool is_there = PETSC_TRUE;
  check(MatGetType(matrix, &matrix_type));
  check(PetscObjectTypeCompareAny(reinterpret_cast<PetscObject>(matrix), &is_aij, MATSEQAIJ, MATMPIAIJ, ""));
  check(PetscObjectTypeCompareAny(reinterpret_cast<PetscObject>(matrix), &is_sbaij, MATSEQSBAIJ, MATMPISBAIJ, ""));
  std::string wanted = "another preconditioner or type of matrix";
  if (is(type, PCPBJACOBI)) {
    check(MatHasOperation(matrix, MATOP_INVERT_BLOCK_DIAGONAL, &is_there));
  } else if (is(type, PCGAMG) || is(type, PCML)) {
    is_there = is_aij;
    wanted = "type aij";
  } else if (is(type, PCSOR) || is(type, PCILU)) {
    is_there = is_sbaij == PETSC_TRUE ? PETSC_FALSE : PETSC_TRUE;
  } else if (is(type, PCEISENSTAT) && system != matrix) {
    throw Error("-" + prefix + "pc_type " + type +
                ": the system has a part that the preconditioner's matrix lacks, expected another preconditioner");
  } else if (is(type, PCLU) || is(type, PCCHOLESKY)) {
    MatSolverType library = nullptr;
    check(PCFactorGetMatSolverType(pc, &library));
    check(MatGetFactorAvailable(matrix, library, is(type, PCLU) ? MAT_FACTOR_LU : MAT_FACTOR_CHOLESKY, &is_there));
  }
  if (is_there == PETSC_FALSE) {
    throw Error("-" + prefix + "pc_type " + type + ": PETSc has none for a matrix of type " + matrix_type +
                ", expected " + wanted);
  }
}

}  // namespace

KspHandle make_ksp(Mat matrix, Mat preconditioning, const std::string& prefix, const KspDefaults& defaults) {
  KspHandle ksp;
  PC pc = nullptr;
  MatType matrix_type = nullptr;
  int ranks = 1;
  MPI_Comm comm = PetscObjectComm(reinterpret_cast<PetscObject>(matrix));
  MPI_Comm_size(comm, &ranks);
  check(KSPCreate(comm, ksp.create()));
  check(KSPSetOptionsPrefix(ksp, prefix.c_str()));
  check(KSPSetOperators(ksp, matrix, preconditioning));
  check(KSPSetType(ksp, defaults.type));
  check(KSPSetTolerances(ksp, defaults.rtol, PETSC_DEFAULT, PETSC_DEFAULT, defaults.max_iterations));
  check(KSPGetPC(ksp, &pc));
  check(MatGetType(preconditioning, &matrix_type));
  const bool matrix_free = is(matrix_type, MATSHELL);
  PetscBool has_blocks = PETSC_FALSE;  // of its diagonal
  check(MatHasOperation(preconditioning, MATOP_INVERT_BLOCK_DIAGONAL, &has_blocks));
  const PCType matrix_free_default = has_blocks == PETSC_TRUE ? PCPBJACOBI : PCJACOBI;
  check(PCSetType(pc, matrix_free ? matrix_free_default : defaults.preconditioner));
  try {
    check(KSPSetFromOptions(ksp));
  } catch (const PetscFailure& failure) {  // A value that PETSc does not know: every rank reads the same.
    throw Error("-" + prefix + "...: " + failure.what());
  }

  PCType type = nullptr;
  check(PCGetType(pc, &type));
  if (matrix_free && !is(type, PCNONE) && !is(type, PCJACOBI) && !(has_blocks == PETSC_TRUE && is(type, PCPBJACOBI))) {
    throw Error("-" + prefix + "pc_type " + type + ": a matrix-free operator has only its diagonal, expected none" +
                (has_blocks == PETSC_TRUE ? ", pbjacobi" : "") + " or jacobi");
  }
  PetscBool use_amat = PETSC_FALSE;
  check(PetscOptionsHasName(nullptr, prefix.c_str(), "-pc_use_amat", &use_amat));
  if (use_amat == PETSC_FALSE && !is(type, PCMG) && !is(type, PCGAMG) && !is(type, PCML)) {
    check(PCSetUseAmat(pc, PETSC_FALSE));  // Multigrid sets it, and leaves it to a type chosen in its place.
  }
  if (is(type, PCASM)) {  // The restricted kind, PETSc's default, is not symmetric as conjugate gradients need it.
    PetscBool is_set = PETSC_FALSE;
    check(PetscOptionsHasName(nullptr, prefix.c_str(), "-pc_asm_type", &is_set));
    if (is_set == PETSC_FALSE) {
      check(PCASMSetType(pc, PC_ASM_BASIC));
    }
  }
  if (!matrix_free) {
    require_available(pc, type, matrix, preconditioning, prefix);
  }
  if (ranks > 1 && (is(type, PCICC) || is(type, PCILU))) {
    make_parallel(pc, prefix, type);
  }
  return ksp;
}

StageResult solve(KSP ksp, Vec right_hand_side, Vec solution) {
  StageResult result;
  KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
  check(KSPSolve(ksp, right_hand_side, solution));
  PetscInt iterations = 0;
  check(KSPGetConvergedReason(ksp, &reason));
  check(KSPGetIterationNumber(ksp, &iterations));
  result.iterations = static_cast<int>(iterations);
  result.converged = reason > 0;
  if (!result.converged) {
    const char* prefix = nullptr;
    check(KSPGetOptionsPrefix(ksp, &prefix));
    result.reason = "the linear solver " + std::string(prefix) + " did not converge (" + KSPConvergedReasons[reason] +
                    " after " + std::to_string(iterations) + " iterations)";
  }
  return result;
}

}  // namespace pellicle
