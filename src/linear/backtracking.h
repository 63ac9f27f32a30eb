#pragma once

#include <functional>
#include <optional>

namespace pellicle {
inline namespace linear {

/// The largest share 1, 1/2, 1/4, ... of a step that lowers a merit function by a ten-thousandth of the decrease that
/// its slope predicts (Armijo); none after 20 halvings. Collective if the merit is.
/// @param merit of a fraction of the step; none where the step is not allowed
/// @param before merit at the start of the step
/// @param slope decrease of the merit per unit share at the start; 0: any decrease is enough
/// @param rounding of the merit; a rise by no more than this is accepted
std::optional<double> backtrack(const std::function<std::optional<double>(double fraction)>& merit, double before,
                                double slope, double rounding);

}  // namespace linear
}  // namespace pellicle
