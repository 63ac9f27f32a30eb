#pragma once

#include <petscksp.h>

#include <string>

#include "base/handle.h"
#include "base/stage_result.h"

namespace pellicle {

/// What a solver is before the user's options are read.
struct KspDefaults {
  KSPType type = KSPCG;
  PCType preconditioner = PCBJACOBI;  ///< its blocks are ICC(0) where the matrix is known to be symmetric
  double rtol = 1e-8;
  int max_iterations = 2000;
};

/// A solver for `matrix`, with the defaults and then the options of `prefix` (such as "heat_") set. A preconditioner
/// that PETSc has for one rank only (icc, ilu) becomes block Jacobi with such blocks on several. Collective.
/// @param preconditioning matrix that the preconditioner is built from
/// @throws Error when `matrix` is matrix-free and the preconditioner needs entries
KspHandle make_ksp(Mat matrix, Mat preconditioning, const std::string& prefix, const KspDefaults& defaults);

/// Solves and says how it went; divergence is a result. Collective.
StageResult solve(KSP ksp, Vec right_hand_side, Vec solution);

}  // namespace pellicle
