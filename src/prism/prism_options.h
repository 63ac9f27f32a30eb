#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/choice.h"
#include "solvers/tangent.h"

namespace pellicle {
inline namespace base {
class OptionTable;
}  // namespace base
inline namespace prism {

/// converged: snes_rtol must be met; fixed: as many iterations as the step may have are enough.
enum class NewtonEnd { converged, fixed };
inline const std::vector<std::string>& names_of(NewtonEnd) {
  static const std::vector<std::string> names{"converged", "fixed"};
  return names;
}

/// When the tangent is factorised. automatic: where iterations are slow.
enum class PrismFactor { automatic, always, never };
inline const std::vector<std::string>& names_of(PrismFactor) {
  static const std::vector<std::string> names{"auto", "always", "never"};
  return names;
}

/// exact: the metric's; gradient: from F, director varied; paper: director left out.
enum class ElementTangent { exact, gradient, paper };
inline const std::vector<std::string>& names_of(ElementTangent) {
  static const std::vector<std::string> names{"exact", "gradient", "paper"};
  return names;
}

/// The implicit step of a balloon (balloon paper, sections 4 and 6); solver options of PETSc have the prefix `prism_`.
struct PrismOptions {
  /// Prefix of PETSc's options for these solvers; in a run of several objects `objects_NAME_` stands before it.
  std::string solver_prefix = "prism_";
  Choice<NewtonEnd> newton = NewtonEnd::converged;
  int max_iterations = 0;   ///< Newton iterations (snes_max_it); 0: see most_iterations
  double snes_rtol = 1e-8;  ///< of the residual, against the largest force; fixed: against that at the step's start
  std::optional<double> ksp_rtol;    ///< see linear_rtol
  double residual_tolerance = 1e-3;  ///< of the residual at the end of a step, against its forces: more is reported
  Choice<TangentMatrix> mat_type = TangentMatrix::baij;
  Choice<PrismFactor> factor = PrismFactor::automatic;
  int patch_size = 30;  ///< vertices of a rigid patch of the preconditioner's coarse level
  Choice<ElementTangent> tangent = ElementTangent::exact;
  bool positive_elements = true;  ///< compressive stresses are left out of the geometric stiffness
  bool line_search = true;        ///< on the potential of the step; elements may not turn over
  bool inertia = true;            ///< false: quasi-static; the damping stays, as drag
  double mass_damping = 20;       ///< C = mass_damping M + stiffness_damping K [1/s]
  double stiffness_damping = 0;   ///< [s]

  /// Most Newton iterations of a step: `max_iterations`, or what follows from `newton`; fixed: the paper's 3.
  int most_iterations() const { return max_iterations > 0 ? max_iterations : newton == NewtonEnd::fixed ? 3 : 200; }
  /// Relative tolerance of the linear solves: `ksp_rtol`, or 1e-4.
  double linear_rtol() const { return ksp_rtol.value_or(1e-4); }
};

void describe(OptionTable& table, PrismOptions& options);

}  // namespace prism
}  // namespace pellicle
