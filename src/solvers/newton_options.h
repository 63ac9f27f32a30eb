#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/choice.h"
#include "solvers/tangent.h"

namespace pellicle {
inline namespace solvers {

/// converged: snes_rtol must be met; fixed: as many iterations as the step may have are enough.
enum class NewtonEnd { converged, fixed };
inline const std::vector<std::string>& names_of(NewtonEnd) {
  static const std::vector<std::string> names{"converged", "fixed"};
  return names;
}

/// When the tangent is factorised. automatic: where iterations are slow.
enum class TangentFactorisation { automatic, always, never };
inline const std::vector<std::string>& names_of(TangentFactorisation) {
  static const std::vector<std::string> names{"auto", "always", "never"};
  return names;
}

/// Which tangent Newton's method uses where the exact one need not be positive definite. exact: the exact one, moved
/// towards the positive one as little as the linear solver asks for; positive: the positive one, and the exact one from
/// where a tenth of the forces is left if more than two digits are asked for.
enum class FarTangent { exact, positive };

/// How Newton's method brings the objects of a step into balance; the options of PETSc have the prefix of one of them.
struct NewtonOptions {
  /// Prefix of PETSc's options for these solvers; in a run of several objects `objects_NAME_` stands before it.
  std::string solver_prefix;
  Choice<NewtonEnd> newton = NewtonEnd::converged;
  int max_iterations = 0;   ///< Newton iterations (snes_max_it); 0: see most_iterations
  double snes_rtol = 1e-8;  ///< of the residual, against the largest force; fixed: against that at the step's start
  std::optional<double> ksp_rtol;    ///< see linear_rtol
  double residual_tolerance = 1e-3;  ///< of the residual at the end of a step, against its forces: more is reported
  Choice<TangentMatrix> mat_type = TangentMatrix::baij;
  Choice<TangentFactorisation> factor = TangentFactorisation::automatic;
  int patch_size = 30;  ///< vertices of a rigid patch of the preconditioner's coarse level
  FarTangent far = FarTangent::exact;
  bool line_search = true;  ///< on the potential of the step; elements may not turn over

  /// Most Newton iterations of a step: `max_iterations`, or what follows from `newton`; fixed: the paper's 3.
  int most_iterations() const { return max_iterations > 0 ? max_iterations : newton == NewtonEnd::fixed ? 3 : 200; }
  /// Relative tolerance of the linear solves: `ksp_rtol`, or 1e-4.
  double linear_rtol() const { return ksp_rtol.value_or(1e-4); }
};

}  // namespace solvers
}  // namespace pellicle
