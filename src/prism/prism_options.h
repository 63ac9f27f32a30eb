#pragma once

#include <string>
#include <vector>

#include "energies/newton_options.h"
#include "options/choice.h"

namespace pellicle::prism {

/// Tangent of the elements. exact: from the metric; gradient: from F, director varied; paper: director left out.
enum class ElementTangent { exact, gradient, paper };
inline std::vector<std::string> names_of(ElementTangent) { return {"exact", "gradient", "paper"}; }

/// The implicit step of a balloon (balloon paper, sections 4 and 6); solver options of PETSc have the prefix `prism_`.
struct PrismOptions : NewtonOptions {
  PrismOptions() { solver_prefix = "prism_"; }

  Choice<ElementTangent> tangent = ElementTangent::exact;
  bool positive_elements = true;  ///< compressive stresses are left out of the geometric stiffness
  bool inertia = true;            ///< false: quasi-static; the damping remains, as drag
  double mass_damping = 20;       ///< C = mass_damping M + stiffness_damping K [1/s]
  double stiffness_damping = 0;   ///< [s]
};

void describe(OptionTable& table, PrismOptions& options);

}  // namespace pellicle::prism
