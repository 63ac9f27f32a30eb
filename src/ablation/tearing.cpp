#include "ablation/tearing.h"

#include <algorithm>
#include <cstdint>

#include "base/noise.h"
#include "geometry/quad_area.h"

namespace pellicle {
inline namespace ablation {

namespace {

enum SumRow { stress_sum = 0, living_cells = 9, sum_rows };

/// One number for each pair of ids, in whatever order they come.
std::uint64_t number_of_pair(PetscInt a, PetscInt b) {
  return (static_cast<std::uint64_t>(std::min(a, b)) << 32) + static_cast<std::uint64_t>(std::max(a, b));
}

/// What is left of a cell, in quarters.
double living_share(const Living& living, std::size_t cell) {
  const auto first = living.triangles.begin() + static_cast<std::ptrdiff_t>(4 * cell);
  return static_cast<double>(std::count(first, first + 4, true)) / 4;
}

Eigen::Vector3d direction(const Field& position, const std::array<PetscInt, 2>& ends) {
  return (position.vector(ends[1]) - position.vector(ends[0])).stableNormalized();
}

}  // namespace

double share_of_strength(double mass_ratio, double min_mass, double char_strength) {
  // What loses no mass has no char.
  const double unburnt = min_mass < 1 ? std::clamp((mass_ratio - min_mass) / (1 - min_mass), 0.0, 1.0) : 1;
  return char_strength + (1 - char_strength) * unburnt;
}

Tearing::Tearing(const Sheet& sheet, const AblationOptions& options, const std::vector<double>& texture)
    : sheet_(sheet),
      char_strength_(options.char_strength),
      particle_sums_(sheet.particles, sum_rows),
      stress_(sheet.cells.size()),
      largest_overload_(sheet.particles, 1) {
  for (std::size_t colour = 0; colour < sheet.springs.size(); ++colour) {
    const SpringSet& set = sheet.springs[colour];
    overload_[colour] = Field(set.layout, 1);
    for (std::size_t s = 0; s < static_cast<std::size_t>(set.owned()); ++s) {
      const auto a = static_cast<std::size_t>(set.ends[s][0]);
      const auto b = static_cast<std::size_t>(set.ends[s][1]);
      const double random = noise(options.seed, number_of_pair(sheet.persistent_id[a], sheet.persistent_id[b]));
      unburnt_strength_[colour].push_back(options.strength.value() * (1 + options.strength_scatter * random) *
                                          (texture.empty() ? 1 : (texture[a] + texture[b]) / 2));
    }
  }
}

std::array<std::vector<PetscInt>, 4> Tearing::torn(const TearingInput& input) {
  find_stress(input);
  find_overload(input);
  // What differs by rounding alone is equal, or the number of ranks would decide which tears.
  const double tie = 1 + 1e-6;
  std::array<std::vector<PetscInt>, 4> torn;
  for (std::size_t colour = 0; colour < torn.size(); ++colour) {
    const SpringSet& set = sheet_.springs[colour];
    for (PetscInt s = 0; s < set.owned(); ++s) {
      const auto [a, b] = set.ends[static_cast<std::size_t>(s)];
      const double overload = overload_[colour].data()[s];
      if (overload > 1 && overload * tie >= std::max(largest_overload_.data()[a], largest_overload_.data()[b])) {
        torn[colour].push_back(s);
      }
    }
  }
  return torn;
}

void Tearing::find_stress(const TearingInput& input) {
  Field::Values sums = particle_sums_.values();
  sums.setZero();
  for (std::size_t colour = 0; colour < sheet_.springs.size(); ++colour) {
    const SpringSet& set = sheet_.springs[colour];
    for (std::size_t s = 0; s < static_cast<std::size_t>(set.owned()); ++s) {
      const auto [a, b] = set.ends[s];
      if (input.living.springs[colour][s]) {
        const Eigen::Vector3d d = direction(input.position, set.ends[s]);
        const Eigen::Matrix3d half = input.force[colour][s] * set.initial_length[s] / 2 * d * d.transpose();
        sums.col(a).head<9>() += half.reshaped();
        sums.col(b).head<9>() += half.reshaped();
      }
    }
  }
  for (std::size_t cell = 0; cell < static_cast<std::size_t>(sheet_.elements.owned); ++cell) {
    for (const PetscInt corner : sheet_.cells[cell]) {
      sums(living_cells, corner) += living_share(input.living, cell);
    }
  }
  particle_sums_.add_ghosts();
  particle_sums_.update_ghosts();

  for (std::size_t cell = 0; cell < stress_.size(); ++cell) {
    stress_[cell].setZero();
    const double share = living_share(input.living, cell);
    if (share > 0) {
      const auto& corners = sheet_.cells[cell];
      auto sum = stress_[cell].reshaped();
      sum += sums.col(sheet_.lattice[cell]).head<9>();
      for (const PetscInt corner : corners) {
        sum += share / sums(living_cells, corner) * sums.col(corner).head<9>();
      }
      const auto rest = [&](std::size_t k) { return sheet_.rest.col(corners[k]); };
      stress_[cell] /= share * quad_area_vector(rest(0), rest(1), rest(2), rest(3)).norm();
    }
  }
}

void Tearing::find_overload(const TearingInput& input) {
  const auto share_at = [&](PetscInt particle) {
    const double left = input.mass.data()[particle] / sheet_.initial_mass[static_cast<std::size_t>(particle)];
    return share_of_strength(left, input.min_mass, char_strength_);
  };
  largest_overload_.values().setZero();
  for (std::size_t colour = 0; colour < sheet_.springs.size(); ++colour) {
    const SpringSet& set = sheet_.springs[colour];
    Field& overload = overload_[colour];
    overload.values().setZero();
    for (std::size_t s = 0; s < static_cast<std::size_t>(set.owned()); ++s) {
      const auto [a, b] = set.ends[s];
      if (!input.living.springs[colour][s] ||
          (input.pinned[static_cast<std::size_t>(a)] && input.pinned[static_cast<std::size_t>(b)])) {
        continue;
      }
      Eigen::Matrix3d stress = Eigen::Matrix3d::Zero();
      double triangles = 0;
      for (const PetscInt triangle : set.triangles[s]) {
        if (triangle >= 0 && input.living.triangles[static_cast<std::size_t>(triangle)]) {
          stress += stress_[static_cast<std::size_t>(triangle) / 4];
          ++triangles;
        }
      }
      const Eigen::Vector3d d = direction(input.position, set.ends[s]);
      const double strength = unburnt_strength_[colour][s] * (share_at(a) + share_at(b)) / 2;
      overload.data()[s] = d.dot(stress * d) / triangles / strength;
    }
    overload.update_ghosts();
    for (PetscInt s = 0; s < set.local(); ++s) {
      for (const PetscInt end : set.ends[static_cast<std::size_t>(s)]) {
        double& largest = largest_overload_.data()[end];
        largest = std::max(largest, overload.data()[s]);
      }
    }
  }
  // All springs at an owned particle are local.
  largest_overload_.update_ghosts();
}

}  // namespace ablation
}  // namespace pellicle
