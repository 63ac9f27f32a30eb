#pragma once

#include <petscksp.h>

#include <functional>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "base/handle.h"
#include "base/stage_result.h"

namespace pellicle {
inline namespace solvers {

/// Settings of a solver before the user's options are read.
struct KspDefaults {
  KSPType type = KSPCG;
  PCType preconditioner = PCBJACOBI;  ///< its blocks are ICC(0) where the matrix is known to be symmetric
  double rtol = 1e-8;
  int max_iterations = 2000;
  double divtol = 1e5;                ///< growth of the residual that ends a solve
  bool single_reduction = false;      ///< of conjugate gradients, one an iteration in place of three
  std::vector<std::string> fields{};  ///< names of the unknowns of a vertex, a particle or a spring, for the DM
  double largest_rtol = 1;            ///< relative tolerance, at most, for which the user may ask
};

/// How exact a solution x of A x = b must be: |b - A x| may be as large as the larger of both numbers says.
struct LinearNeed {
  double relative = 0;  ///< share of |b|
  double absolute = 0;  ///< in the unit of b
};

/// Largest relative tolerance of a solver whose solution nothing judges that comes after it.
constexpr double largest_unjudged_rtol = 0.1;

/// Additional share that MUMPS gets of the memory that it estimates [%]: on several ranks it needs more, how much
/// depends on the order of messages, and with the default (20) small systems now and then fail.
constexpr PetscInt mumps_room = 100;
constexpr PetscInt mumps_room_setting = 14;  ///< MUMPS' number of this setting

/// A solver for `matrix`, with the defaults and then the options of `prefix` (such as "heat_") set. A preconditioner
/// that PETSc has for one rank only (icc, ilu) becomes block Jacobi with such blocks on several. Collective.
/// @param preconditioning matrix that the preconditioner is built from
/// @throws Error that names the option: a type or solver package that PETSc does not have, or that the matrix does not
/// allow, or a tolerance that is no tolerance
KspHandle make_ksp(Mat matrix, Mat preconditioning, const std::string& prefix, const KspDefaults& defaults);

/// Whether any of PETSc's options of a prefix is given. @param names such as "ksp_type"
bool any_is_given(const std::string& prefix, std::initializer_list<const char*> names);

/// Whether the options of a solver ask for entries of its matrix: for another preconditioner than none and the
/// diagonal, to scale the matrix, to see or to save it.
bool asks_for_entries(const std::string& prefix);

/// Tells PETSc that a matrix is symmetric positive definite whatever values it gets, or, where PETSc's type cannot know
/// that, that it is symmetric.
void set_definite(Mat matrix);

/// Reads the options `-<prefix>mat_...` of a matrix whose type is given. Collective. @throws Error on `mat_type`, which
/// no option of PETSc can change here
void set_matrix_options(Mat matrix, const std::string& prefix);

/// Runs calls of PETSc's that set up or run the solvers of `prefix`. @throws Error that names their options when PETSc
/// cannot do as they say
void run_solver(const std::string& prefix, const std::function<void()>& calls);

/// How a solve of a symmetric system that should be positive definite ended. no: it failed for another reason than the
/// two that follow, a preconditioner that is not positive definite or could not be made, and a matrix that is not
/// positive definite.
enum class Solved { yes, no, bad_preconditioner, concave };

/// How a linear solve went.
struct LinearResult : StageResult {
  KSPConvergedReason ended = KSP_CONVERGED_ITERATING;  ///< PETSc's name for it
  Solved solved = Solved::yes;

  /// Marks it as not converged.
  void refuse(Solved why, std::string words) {
    converged = false;
    solved = why;
    reason = std::move(words);
  }
};

/// Gives a solver, whose options have been read, StopPoints before each solve and in each iteration. make_ksp does so.
void make_stoppable(KSP ksp);

/// Solves and says how it went; divergence is a result. Where the solver tests no residual itself (preonly, no norm),
/// the true one is tested. Collective. @throws Error that names the solver's options when PETSc cannot do as they say;
/// Stopped, see make_stoppable
/// @param need null: what uses the solution judges it. Otherwise the true residual is also tested where the solver has
/// ended by an absolute tolerance, which says nothing about the right-hand side
LinearResult solve(KSP ksp, Vec right_hand_side, Vec solution, const LinearNeed* need = nullptr);

/// What is wrong with a solution whose residual b - A x was not tested; empty if it is what is needed, or what rounding
/// leaves of a direct solve. Collective. @param preconditioning a matrix whose diagonal is as large as A's
std::string fault_of_solution(Mat matrix, Mat preconditioning, Vec right_hand_side, Vec solution,
                              const LinearNeed& need);

}  // namespace solvers
}  // namespace pellicle
