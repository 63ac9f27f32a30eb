#pragma once

#include <petscksp.h>

#include <algorithm>
#include <functional>
#include <initializer_list>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/handle.h"
#include "base/stage_result.h"

namespace pellicle::linear {

/// Settings of a solver before the user's options are read.
struct KspDefaults {
  KSPType type = KSPCG;
  PCType preconditioner = PCBJACOBI;  ///< its blocks are ICC(0) where the matrix is known to be symmetric
  double rtol = 1e-8;
  int max_iterations = 2000;
  double divtol = 1e5;                ///< growth of the residual that ends a solve
  bool single_reduction = false;      ///< of conjugate gradients: one reduction an iteration, not three
  std::vector<std::string> fields{};  ///< names of the unknowns of a vertex, a particle or a spring, for the DM
  double largest_rtol = 1;            ///< largest relative tolerance that the user may set
};

/// Accuracy that a solution x of A x = b needs: |b - A x| at most the larger of both tolerances.
struct LinearNeed {
  double relative = 0;  ///< fraction of |b|
  double absolute = 0;  ///< in the unit of b
};

/// Largest relative tolerance of a solver whose solution is not checked by anything afterwards.
constexpr double largest_unjudged_rtol = 0.1;

/// Memory for MUMPS beyond its estimate [%]: on several ranks the need depends on the order of messages, and with the
/// default (20) small systems sometimes fail.
constexpr PetscInt mumps_room = 100;
constexpr PetscInt mumps_room_setting = 14;  ///< MUMPS' number of this setting

/// A solver for `matrix`, with the defaults and then the options of `prefix` (such as "heat_") set. A preconditioner
/// that PETSc has for one rank only (icc, ilu) becomes block Jacobi with such blocks on several ranks. Collective.
/// @param preconditioning matrix that the preconditioner is built from
/// @throws Error that names the option: a type or solver package that PETSc does not have, or that the matrix does not
/// allow, or a tolerance that is no tolerance
KspHandle make_ksp(Mat matrix, Mat preconditioning, const std::string& prefix, const KspDefaults& defaults);

/// The prefix of a solver's options.
std::string prefix_of(KSP ksp);

/// The value of an option of PETSc, if it is given. @param name such as "-heat_ksp_type"
std::optional<std::string> option_value(const std::string& name);

/// Whether any of PETSc's options of a prefix is given. @param names such as "ksp_type"
bool any_is_given(const std::string& prefix, std::initializer_list<const char*> names);

/// Whether the options of a solver need entries of its matrix: for a preconditioner other than none and the diagonal,
/// or to scale, view or save the matrix.
bool asks_for_entries(const std::string& prefix);

/// Marks a matrix as symmetric positive definite for all its values to come, or as symmetric where PETSc's type has no
/// such mark.
void set_definite(Mat matrix);

/// Reads the options `-<prefix>mat_...` of a matrix whose type is given. Collective. @throws Error on `mat_type`, which
/// no option of PETSc can change here
void set_matrix_options(Mat matrix, const std::string& prefix);

/// Runs PETSc calls that set up or run the solvers of `prefix`. @throws Error that names their options when PETSc
/// cannot follow them
void run_solver(const std::string& prefix, const std::function<void()>& calls);

/// End of a solve of a symmetric system that should be positive definite. bad_preconditioner: it is not positive
/// definite or could not be made; concave: the matrix is not positive definite; no: failed for another reason.
enum class Solved { yes, no, bad_preconditioner, concave };

/// Result of a linear solve.
struct LinearResult : StageResult {
  KSPConvergedReason ended = KSP_CONVERGED_ITERATING;  ///< reason in PETSc's terms
  Solved solved = Solved::yes;

  /// Becomes the result of a further solve, with the iterations of both. @returns whether that has converged
  bool go_on(LinearResult further) {
    further.iterations += iterations;
    *this = std::move(further);
    return converged;
  }

  /// Marks the result as not converged.
  void refuse(Solved why, std::string words) {
    converged = false;
    solved = why;
    reason = std::move(words);
  }
};

/// Adds StopPoints to a solver whose options have been read, before each solve and in each iteration. make_ksp does so.
void make_stoppable(KSP ksp);

/// Solves; divergence is a result, not an error. If the solver tests no residual (preonly, no norm), the true one is
/// tested. Collective. @throws Error that names the solver's options when PETSc cannot follow them; Stopped at a
/// StopPoint (make_stoppable)
/// @param need null: the caller checks the solution. Otherwise the true residual is also tested if the solver has ended
/// by an absolute tolerance, which is independent of the right-hand side
LinearResult solve(KSP ksp, Vec right_hand_side, Vec solution, const LinearNeed* need = nullptr);

/// Message if a solution's untested residual b - A x exceeds the need and the rounding of a direct solve; otherwise
/// empty. Collective. @param preconditioning a matrix whose diagonal is as large as A's
std::string fault_of_solution(Mat matrix, Mat preconditioning, Vec right_hand_side, Vec solution,
                              const LinearNeed& need);

/// Decides when a preconditioner is renewed while its matrix changes: when the iterations of its solves beyond those of
/// the shortest solve have cost as much as a new one.
class PreconditionerLag {
 public:
  /// Whether a new preconditioner is due: there is none yet, the last solve failed, or solves have become slow. To be
  /// called once after each solve.
  bool due(KSP solver) {
    constexpr PetscInt worth_renewing = 50;  // iterations that cost about as much as a new preconditioner
    PetscInt iterations = 0;
    KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
    check(KSPGetIterationNumber(solver, &iterations));
    check(KSPGetConvergedReason(solver, &reason));
    if (!has_one_ || reason <= 0) {
      return true;
    }
    fewest_iterations_ = std::min(fewest_iterations_, iterations);
    wasted_iterations_ += iterations - fewest_iterations_;
    return wasted_iterations_ >= worth_renewing;
  }

  /// Notes that the preconditioner has been renewed.
  void renewed() {
    has_one_ = true;
    fewest_iterations_ = PETSC_MAX_INT;
    wasted_iterations_ = 0;
  }

  /// Notes that the present preconditioner has become useless.
  void forget() { has_one_ = false; }

 private:
  bool has_one_ = false;
  PetscInt fewest_iterations_ = 0;  ///< of a solve with the present preconditioner
  PetscInt wasted_iterations_ = 0;  ///< of all these solves, beyond the fewest each
};

}  // namespace pellicle::linear
