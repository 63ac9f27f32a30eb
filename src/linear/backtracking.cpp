#include "linear/backtracking.h"

namespace pellicle {
inline namespace linear {

namespace {

constexpr int max_halvings = 20;
constexpr double sufficient_decrease = 1e-4;

}  // namespace

std::optional<double> backtrack(const std::function<std::optional<double>(double)>& merit, double before, double slope,
                                double rounding) {
  double fraction = 1;
  for (int halvings = 0; halvings <= max_halvings; ++halvings, fraction /= 2) {
    const std::optional<double> now = merit(fraction);
    if (now && *now <= before - sufficient_decrease * fraction * slope + rounding) {
      return fraction;
    }
  }
  return std::nullopt;
}

}  // namespace linear
}  // namespace pellicle
