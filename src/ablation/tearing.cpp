#include "ablation/tearing.h"

#include <Eigen/Eigenvalues>
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
      overload_(sheet.of(Colour::blue).layout, 1),
      largest_overload_(sheet.particles, 1) {
  const SpringSet& sides = sheet.of(Colour::blue);
  for (std::size_t s = 0; s < static_cast<std::size_t>(sides.owned()); ++s) {
    const auto a = static_cast<std::size_t>(sides.ends[s][0]);
    const auto b = static_cast<std::size_t>(sides.ends[s][1]);
    const auto id = [&](std::size_t k) {
      const PetscInt triangle = sides.triangles[s][k];
      return triangle < 0 ? 0 : sheet.element_id[static_cast<std::size_t>(triangle / 4)];
    };
    // Of the cells, whose ids stay when corners double.
    const double random = noise(options.seed, number_of_pair(id(0), id(1)));
    unburnt_strength_.push_back(options.strength.value() * (1 + options.strength_scatter * random) *
                                (texture.empty() ? 1 : (texture[a] + texture[b]) / 2));
  }
}

std::vector<PetscInt> Tearing::cracks(const TearingInput& input) {
  find_stress(input);
  const SpringSet& sides = sheet_.of(Colour::blue);
  for (std::size_t s = 0; s < static_cast<std::size_t>(sides.owned()); ++s) {
    overload_.data()[s] = overload(input, s);
  }
  overload_.update_ghosts();
  largest_overload_.values().setZero();
  // Sides compete at their ends and in their cells, whose lattice points stand for them.
  const auto places = [&](PetscInt s) {
    const auto k = static_cast<std::size_t>(s);
    std::array<PetscInt, 4> result{sides.ends[k][0], sides.ends[k][1], -1, -1};
    for (std::size_t t = 0; t < 2; ++t) {
      const PetscInt triangle = sides.triangles[k][t];
      result[2 + t] = triangle < 0 ? -1 : sheet_.lattice[static_cast<std::size_t>(triangle / 4)];
    }
    return result;
  };
  for (PetscInt s = 0; s < sides.local(); ++s) {
    for (const PetscInt place : places(s)) {
      if (place >= 0) {
        double& largest = largest_overload_.data()[place];
        largest = std::max(largest, overload_.data()[s]);
      }
    }
  }
  // All springs at an owned particle, and along the sides of an owned cell, are local.
  largest_overload_.update_ghosts();
  // What differs by rounding alone is equal, or the number of ranks would decide which side cracks.
  const double tie = 1 + 1e-6;
  std::vector<PetscInt> cracks;
  for (PetscInt s = 0; s < sides.owned(); ++s) {
    const double here = overload_.data()[s];
    const std::array<PetscInt, 4> of_side = places(s);
    if (here > 0 && std::all_of(of_side.begin(), of_side.end(),
                                [&](PetscInt place) { return here * tie >= largest_overload_.data()[place]; })) {
      cracks.push_back(s);
    }
  }
  return cracks;
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

/// Stress across an owned blue spring's side over the strength; 0 where it cannot crack.
double Tearing::overload(const TearingInput& input, std::size_t side) const {
  const SpringSet& sides = sheet_.of(Colour::blue);
  const auto [a, b] = sides.ends[side];
  if (input.pinned[static_cast<std::size_t>(a)] && input.pinned[static_cast<std::size_t>(b)]) {
    return 0;
  }
  const Eigen::Vector3d along = direction(input.position, sides.ends[side]);
  Eigen::Matrix3d stress = Eigen::Matrix3d::Zero();
  double across = 0;
  for (std::size_t k = 0; k < 2; ++k) {
    const PetscInt triangle = sides.triangles[side][k];
    if (triangle < 0 || !input.living.triangles[static_cast<std::size_t>(triangle)] ||
        input.living.cracked[static_cast<std::size_t>(triangle)]) {
      return 0;
    }
    const auto cell = static_cast<std::size_t>(triangle / 4);
    const auto corner = [&](std::size_t i) { return input.position.vector(sheet_.cells[cell][i]); };
    const Eigen::Vector3d normal =
        along.cross(quad_area_vector(corner(0), corner(1), corner(2), corner(3))).stableNormalized();
    stress += stress_[cell] / 2;
    across += normal.dot(stress_[cell] * normal) / 2;
  }
  const auto share_at = [&](PetscInt particle) {
    const double left = input.mass.data()[particle] / sheet_.initial_mass[static_cast<std::size_t>(particle)];
    return share_of_strength(left, input.min_mass, char_strength_);
  };
  const double strength = unburnt_strength_[side] * (share_at(a) + share_at(b)) / 2;
  if (across <= 0 || stress.norm() <= strength) {
    return 0;
  }
  const double principal =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(stress, Eigen::EigenvaluesOnly).eigenvalues()[2];
  constexpr double least_share = 0.25;  // up to 60 degrees: sides of other directions are nearer
  return principal > strength && across >= least_share * principal ? across / strength : 0;
}

}  // namespace ablation
}  // namespace pellicle
