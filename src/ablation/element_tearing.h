#pragma once

#include <vector>

#include "ablation/ablation_options.h"
#include "parallel/field.h"
#include "surface/living.h"

namespace pellicle {
inline namespace ablation {

/// Tearing of a membrane, whose stress is known element by element: an element tears when
///
///     tension > strength c (1 + scatter u) t
///
/// with the largest principal stress times the present thickness as its tension, the mean t of the texture and c of the
/// share of the strength at its vertices (share_of_strength), and a random number u in [-1, 1) of seed and id. Of the
/// elements that meet at a vertex only the one that exceeds its strength by the largest factor tears in a step.
class ElementTearing {
 public:
  /// The surface must outlive this object. Collective.
  /// @param options with a strength
  /// @param texture factor on the strength of each local particle, or empty for 1
  ElementTearing(const Surface& surface, const AblationOptions& options, const std::vector<double>& texture);

  /// Owned elements that tear. Collective.
  /// @param tension of the local elements [N/m]
  /// @param min_mass m^min as a fraction of the initial mass
  std::vector<PetscInt> torn(const std::vector<double>& tension, const Living& living, const Field& mass,
                             double min_mass);

 private:
  const Surface& surface_;
  double char_strength_;
  std::vector<double> unburnt_strength_;  ///< of the local elements [N/m]
  Field largest_overload_;                ///< of the elements at each local particle
};

}  // namespace ablation
}  // namespace pellicle
