#include "surface/weave_strain.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/units.h"
#include "parallel/collective.h"

namespace pellicle::surface {

WeaveStrain weave_strain(const Sheet& sheet, const Field& x, const std::array<std::vector<double>, 4>& target_length,
                         const ActiveSet& active, const std::array<std::vector<bool>, 4>& bears) {
  using Key = std::array<PetscInt, 3>;  // ids of the ends, colour
  constexpr PetscInt last_id = std::numeric_limits<PetscInt>::max();
  constexpr Key none{last_id, last_id, last_id};
  WeaveStrain strain;
  Key key = none;
  // Sums over the owned springs, then over all: squares and numbers of each colour, sum and number of springs under
  // load.
  std::array<double, 10> sums{};
  for (const Colour colour : all_colours) {
    if (!sheet.acts(colour)) {
      continue;
    }
    const SpringSet& springs = sheet.of(colour);
    double sum = 0;
    for (PetscInt s = 0; s < springs.owned(); ++s) {
      if (!active.springs[colour][s]) {
        continue;
      }
      const auto [a, b] = springs.ends[s];
      const double value = std::abs((x.vector(a) - x.vector(b)).norm() / target_length[colour][s] - 1);
      sums[colour] += value * value;
      ++sums[4 + colour];
      if (bears[colour][s]) {
        sum += value;
        ++sums[9];
      }
      strain.largest_of[colour] = std::max(strain.largest_of[colour], value);
      if (is_of_weave(colour) && value >= strain.largest) {
        const auto [first, last] = std::minmax(sheet.persistent_id[a], sheet.persistent_id[b]);
        const Key own{first, last, static_cast<PetscInt>(colour)};
        if (value > strain.largest || own < key) {
          strain.largest = value;
          key = own;
          strain.place = (x.vector(a) + x.vector(b)) / 2;
        }
      }
    }
    sums[8] += sum;
  }
  sums = sum_over_ranks(sheet.comm(), sums);
  strain.largest_of = max_over_ranks(sheet.comm(), strain.largest_of);
  strain.mean = sums[8] / std::max(1.0, sums[9]);
  for (std::size_t colour = 0; colour < 4; ++colour) {
    strain.rms_of[colour] = std::sqrt(sums[colour] / std::max(1.0, sums[4 + colour]));
  }

  const double own_largest = strain.largest;
  strain.largest = max_over_ranks(sheet.comm(), strain.largest);
  const Key own = own_largest == strain.largest ? key : none;
  Key first{};  // in the order of the keys: one number after the other; nothing is allocated in a step
  bool is_first = true;
  for (std::size_t k = 0; k < own.size(); ++k) {
    first[k] = is_first ? own[k] : last_id;
    first[k] = min_over_ranks(sheet.comm(), first[k]);
    is_first = is_first && own[k] == first[k];
  }
  if (first == none) {
    return strain;
  }
  strain.ids = {first[0], first[1]};
  strain.colour = static_cast<Colour>(first[2]);
  if (!is_first) {
    strain.place.setZero();
  }
  sum_over_ranks(sheet.comm(), strain.place);
  return strain;
}

std::string words_of(double strain, const Eigen::Vector3d& place) {
  return fmt::format("{:.3g} % at ({:.4g}, {:.4g}, {:.4g}) m", 100 * strain, place[0], place[1], place[2]);
}

std::string beyond_limit(const WeaveStrain& strain, double limit) {
  return fmt::format("the {} spring of particles {} and {} is strained by {}, above project.strain_limit {}",
                     colour_names[strain.colour], strain.ids[0], strain.ids[1], words_of(strain.largest, strain.place),
                     number_text(limit));
}

}  // namespace pellicle::surface
