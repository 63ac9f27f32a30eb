#pragma once

#include <functional>
#include <optional>

namespace pellicle {
inline namespace solvers {

/// The longest of the shares 1, 1/2, 1/4, ... of a step that lowers a merit function by a ten-thousandth of what its
/// slope promises (Armijo); nothing if no share of 20 halvings does. Collective if the merit is.
/// @param merit of a share of the step, or nothing where it may not go
/// @param before the merit without the step
/// @param slope by which the merit falls at the start of the step; 0 asks for a decrease only
/// @param rounding of the merit: a rise by no more than this does not count
std::optional<double> backtrack(const std::function<std::optional<double>(double share)>& merit, double before,
                                double slope, double rounding);

}  // namespace solvers
}  // namespace pellicle
