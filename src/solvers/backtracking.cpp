#include "solvers/backtracking.h"

namespace pellicle {
inline namespace solvers {

namespace {

constexpr int max_halvings = 20;
constexpr double sufficient_decrease = 1e-4;

}  // namespace

std::optional<double> backtrack(const std::function<std::optional<double>(double)>& merit, double before, double slope,
                                double rounding) {
  double share = 1;
  for (int halvings = 0; halvings <= max_halvings; ++halvings, share /= 2) {
    const std::optional<double> now = merit(share);
    if (now && *now <= before - sufficient_decrease * share * slope + rounding) {
      return share;
    }
  }
  return std::nullopt;
}

}  // namespace solvers
}  // namespace pellicle
