#include "linear/saved_system.h"

#include <petscviewer.h>

#include <fstream>

#include "base/error.h"
#include "base/handle.h"
#include "linear/ksp.h"

namespace pellicle::linear {

namespace {

using ViewerHandle = Handle<PetscViewer, PetscViewerDestroy>;

/// The file that the option of a prefix names; empty if it is not given.
std::string path_of(const std::string& prefix) { return option_value("-" + prefix + "save_system").value_or(""); }

PetscErrorCode save_before_solve(KSP ksp, Vec right_hand_side, Vec /*solution*/, void* /*context*/) noexcept {
  return as_petsc_callback([&] {
    Mat matrix = nullptr;
    ViewerHandle viewer;
    check(KSPGetOperators(ksp, nullptr, &matrix));
    check(PetscViewerBinaryOpen(comm_of(ksp), path_of(prefix_of(ksp)).c_str(), FILE_MODE_WRITE, viewer.create()));
    check(MatView(matrix, viewer));
    check(VecView(right_hand_side, viewer));
  });
}

}  // namespace

void save_systems(KSP ksp, const std::string& prefix) {
  const std::string path = path_of(prefix);
  if (path.empty()) {
    return;
  }
  Mat matrix = nullptr;
  check(KSPGetOperators(ksp, nullptr, &matrix));
  if (has_type(matrix, {MATSHELL})) {
    throw Error("-" + prefix + "save_system: the matrix is not assembled, expected -" + prefix + "mat_type aij");
  }
  if (!std::ofstream(path, std::ios::app)) {
    throw Error("-" + prefix + "save_system: cannot write " + path);
  }
  check(KSPSetPreSolve(ksp, save_before_solve, nullptr));
}

void replay(MPI_Comm comm, const std::string& file) {
  if (!std::ifstream(file)) {
    throw Error("replay: cannot read " + file + ", expected a file that -heat_save_system or the like has written");
  }
  MatHandle matrix;
  VecHandle right_hand_side;
  VecHandle solution;
  VecHandle left;
  check(MatCreate(comm, matrix.create()));
  check(MatSetType(matrix, MATAIJ));
  try {
    ViewerHandle viewer;
    check(PetscViewerBinaryOpen(comm, file.c_str(), FILE_MODE_READ, viewer.create()));
    check(MatLoad(matrix, viewer));
    check(MatCreateVecs(matrix, solution.create(), right_hand_side.create()));
    check(VecLoad(right_hand_side, viewer));
  } catch (const PetscFailure&) {
    throw Error("replay: " + file +
                " holds no matrix and right-hand side of PETSc's, expected what -heat_save_system " +
                "or the like has written");
  }
  check(VecDuplicate(right_hand_side, left.create()));
  set_definite(matrix);

  const KspHandle ksp = make_ksp(matrix, matrix, "replay_", {});
  const double begin = MPI_Wtime();
  run_solver("replay_", [&] { check(KSPSetUp(ksp)); });
  const double ready = MPI_Wtime();
  const LinearResult result = solve(ksp, right_hand_side, solution);
  const double end = MPI_Wtime();

  PetscInt rows = 0;
  MatInfo info;
  double residual = 0;
  double size = 0;
  check(MatGetSize(matrix, &rows, nullptr));
  check(MatGetInfo(matrix, MAT_GLOBAL_SUM, &info));
  check(MatMult(matrix, solution, left));
  check(VecAYPX(left, -1, right_hand_side));
  check(VecNorm(left, NORM_2, &residual));
  check(VecNorm(right_hand_side, NORM_2, &size));
  check(PetscPrintf(
      comm,
      "%s: %d rows, %.0f entries\n%s, %s: %d iterations, set-up %.3g s, solve %.3g s, true residual %.2e of "
      "the right-hand side\n",
      file.c_str(), static_cast<int>(rows), info.nz_used, type_of(KSP(ksp)), type_of(preconditioner_of(ksp)),
      result.iterations, ready - begin, end - ready, size > 0 ? residual / size : residual));
  if (!result.converged) {
    throw Error("replay: " + result.reason);
  }
}

}  // namespace pellicle::linear
