#pragma once

#include <functional>
#include <optional>

#include "base/namespaces.h"

namespace pellicle::linear {

/// The largest share 1, 1/2, 1/4, ... of a step that lowers a merit function by a ten-thousandth of the decrease that
/// its slope predicts (Armijo); none after 20 halvings. Collective if the merit is.
/// @param merit of a fraction of the step; none where the step is not allowed
/// @param before merit at the start of the step
/// @param slope decrease of the merit per unit share at the start; 0: any decrease is enough
/// @param rounding of the merit; a rise by no more than this is accepted
inline std::optional<double> backtrack(const std::function<std::optional<double>(double fraction)>& merit,
                                       double before, double slope, double rounding) {
  constexpr int max_halvings = 20;
  constexpr double sufficient_decrease = 1e-4;
  double fraction = 1;
  for (int halvings = 0; halvings <= max_halvings; ++halvings, fraction /= 2) {
    const std::optional<double> now = merit(fraction);
    if (now && *now <= before - sufficient_decrease * fraction * slope + rounding) {
      return fraction;
    }
  }
  return std::nullopt;
}

}  // namespace pellicle::linear
