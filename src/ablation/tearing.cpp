#include "ablation/tearing.h"

#include <algorithm>
#include <cstdint>

#include "base/noise.h"

namespace pellicle {

namespace {

/// One number for each pair of ids, in whatever order they come.
std::uint64_t number_of_pair(PetscInt a, PetscInt b) {
  return (static_cast<std::uint64_t>(std::min(a, b)) << 32) + static_cast<std::uint64_t>(std::max(a, b));
}

}  // namespace

Tearing::Tearing(const Sheet& sheet, const AblationOptions& options, const std::vector<double>& texture)
    : sheet_(sheet), char_strength_(options.char_strength) {
  for (std::size_t colour = 0; colour < sheet.springs.size(); ++colour) {
    const SpringSet& set = sheet.springs[colour];
    for (std::size_t s = 0; s < static_cast<std::size_t>(set.owned()); ++s) {
      const auto a = static_cast<std::size_t>(set.ends[s][0]);
      const auto b = static_cast<std::size_t>(set.ends[s][1]);
      const double random = noise(options.seed, number_of_pair(sheet.persistent_id[a], sheet.persistent_id[b]));
      unburnt_strength_[colour].push_back(options.strength.value() * set.initial_length[s] *
                                          (1 + options.strength_scatter * random) *
                                          (texture.empty() ? 1 : (texture[a] + texture[b]) / 2));
    }
  }
}

std::array<std::vector<PetscInt>, 4> Tearing::torn(const TearingInput& input) const {
  // A sheet that loses no mass has no char.
  const auto share_of_strength = [&](PetscInt particle) {
    const double left = input.mass.data()[particle] / sheet_.initial_mass[static_cast<std::size_t>(particle)];
    const double unburnt =
        input.min_mass < 1 ? std::clamp((left - input.min_mass) / (1 - input.min_mass), 0.0, 1.0) : 1;
    return char_strength_ + (1 - char_strength_) * unburnt;
  };
  const auto inverse_mass = [&](PetscInt particle) {
    return input.pinned[static_cast<std::size_t>(particle)] ? 0 : 1 / input.mass.data()[particle];
  };
  std::array<std::vector<PetscInt>, 4> torn;
  for (std::size_t colour = 0; colour < torn.size(); ++colour) {
    const SpringSet& set = sheet_.springs[colour];
    for (std::size_t s = 0; s < static_cast<std::size_t>(set.owned()); ++s) {
      if (!input.living.springs[colour][s] || input.pull[colour][s] <= 0) {
        continue;
      }
      const auto [a, b] = set.ends[s];
      const double inverse_masses = inverse_mass(a) + inverse_mass(b);
      const double strength = unburnt_strength_[colour][s] * (share_of_strength(a) + share_of_strength(b)) / 2;
      if (inverse_masses > 0 && input.pull[colour][s] / (input.h * input.h * inverse_masses) > strength) {
        torn[colour].push_back(static_cast<PetscInt>(s));
      }
    }
  }
  return torn;
}

}  // namespace pellicle
