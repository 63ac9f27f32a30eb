#pragma once

#include <optional>
#include <string>
#include <vector>

#include "energies/tangent.h"
#include "options/choice.h"

namespace pellicle::energies {

/// Criterion for a step's end. converged: snes_rtol must be met; fixed: max_iterations are enough.
enum class NewtonEnd { converged, fixed };
inline std::vector<std::string> names_of(NewtonEnd) { return {"converged", "fixed"}; }

/// When the tangent is factorised. automatic: if iterations are slow.
enum class TangentFactorisation { automatic, always, never };
inline std::vector<std::string> names_of(TangentFactorisation) { return {"auto", "always", "never"}; }

/// The steps whose tangent is factorised from the start because iterations have failed. A part of an object's state, so
/// that a run goes on from a checkpoint as without it.
struct FactorisedSteps {
  PetscInt in_a_row = 0;  ///< number of the present row of such steps
  PetscInt left = 0;      ///< steps of this row that are still to come
};

/// Tangent of Newton's method far from balance. exact: the exact one, moved towards the positive one as little as the
/// linear solver needs; positive: the positive one, and if snes_rtol asks for more than two digits the exact one once
/// the residual is a tenth of the forces.
enum class FarTangent { exact, positive };

/// Options of Newton's method for a step; PETSc's options have the prefix of one of the objects.
struct NewtonOptions {
  /// Prefix of PETSc's options for these solvers; in a run of several objects `objects_NAME_` stands before it.
  std::string solver_prefix;
  Choice<NewtonEnd> newton = NewtonEnd::converged;
  int max_iterations = 0;            ///< Newton iterations (snes_max_it); 0: default of most_iterations
  double snes_rtol = 1e-8;           ///< residual over the largest force; fixed: over that at the step's start
  std::optional<double> ksp_rtol;    ///< none: default of linear_rtol
  double residual_tolerance = 1e-3;  ///< residual over forces at a step's end above which it is reported
  Choice<TangentMatrix> mat_type = TangentMatrix::baij;
  Choice<TangentFactorisation> factor = TangentFactorisation::automatic;
  int patch_size = 30;  ///< vertices of a rigid patch of the preconditioner's coarse level
  FarTangent far = FarTangent::exact;
  bool line_search = true;  ///< on the potential of the step; elements may not turn over

  /// Most Newton iterations of a step: `max_iterations`, or by default 200; fixed: the paper's 3.
  int most_iterations() const { return max_iterations > 0 ? max_iterations : newton == NewtonEnd::fixed ? 3 : 200; }
  /// Relative tolerance of the linear solves: `ksp_rtol`, or 1e-4.
  double linear_rtol() const { return ksp_rtol.value_or(1e-4); }
};

}  // namespace pellicle::energies
