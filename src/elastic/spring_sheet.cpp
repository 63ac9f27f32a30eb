#include "elastic/spring_sheet.h"

#include <algorithm>
#include <numeric>

#include "parallel/collective.h"

namespace pellicle::elastic {

namespace {

/// Mean length of all springs of the undeformed sheet [m]. Collective.
double mean_length(const Sheet& sheet) {
  std::array<double, 2> length_and_count{};
  for (const SpringSet& set : sheet.springs) {
    length_and_count[0] += std::accumulate(set.initial_length.begin(), set.initial_length.begin() + set.owned(), 0.0);
    length_and_count[1] += set.owned();
  }
  length_and_count = sum_over_ranks(sheet.comm(), length_and_count);
  return length_and_count[0] / std::max(1.0, length_and_count[1]);
}

}  // namespace

SpringSheet::SpringSheet(const Sheet& sheet, const SpringOptions& options, const std::vector<bool>& pinned,
                         double usual_h, const std::vector<Potential*>& others)
    : SheetPart(sheet, options.damping, options.snes_rtol, pinned, usual_h, others),
      springs_(sheet),
      stiffness_(options.stiffness) {
  potentials_.insert(potentials_.begin(), &springs_);
  negligible_force_ = (1 + damping_ / usual_h) * options.stiffness * options.newton_tolerance *
                      options.newton_tolerance * mean_length(sheet);
  set_scales();
}

void SpringSheet::set_shape(const SheetInput& input) {
  const double damping = damping_ / input.damping_h;
  springs_.set([&](Colour colour, std::size_t s) -> SpringPotential::Hooke {
    const SpringSet& set = sheet_.of(colour);
    if (!input.active.springs[colour][s]) {
      return {0, set.initial_length[s]};
    }
    const auto [a, b] = set.ends[s];
    const double k = stiffness_ * (input.stiffness_factor[a] + input.stiffness_factor[b]) / 2;
    const double l = input.target_length[colour][s];
    return {k, l, {damping * k, damping > 0 ? (input.y_v.vector(a) - input.y_v.vector(b)).norm() : 0}};
  });
}

}  // namespace pellicle::elastic
