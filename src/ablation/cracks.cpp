#include "ablation/cracks.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "base/noise.h"
#include "base/units.h"
#include "parallel/collective.h"
#include "surface/drawn_surface.h"

namespace pellicle::ablation {

namespace {

/// Number of parts, none longer than a quarter, into which a length in units of the field's is divided; at most 32,
/// since the least of so many nearly independent numbers is close to -1.
int parts_of(double length) { return static_cast<int>(std::clamp(std::ceil(4 * length), 1.0, 32.0)); }

/// The least value of the field of noise at places all over a local element.
double least_noise(const Surface& surface, std::size_t element, int seed, double length) {
  std::array<Eigen::Vector3d, 5> corners;  // in units of the length
  for (std::size_t k = 0; k < corners.size(); ++k) {
    corners[k] = surface.rest.col(surface.corner(element, k)) / length;
  }
  const auto side = [&](std::size_t k) { return (corners[k + 1] - corners[k]).norm(); };
  double least = 1;
  const auto look_at = [&](const Eigen::Vector3d& place) { least = std::min(least, noise(seed, place)); };
  if (surface.has_quads()) {
    const int columns = parts_of(std::max(side(0), side(2)));
    const int rows = parts_of(std::max(side(1), side(3)));
    for (int i = 0; i < columns; ++i) {
      for (int j = 0; j < rows; ++j) {
        const double u = (i + 0.5) / columns;
        const double v = (j + 0.5) / rows;
        look_at((1 - v) * ((1 - u) * corners[0] + u * corners[1]) + v * ((1 - u) * corners[3] + u * corners[2]));
      }
    }
  } else {
    const int parts = parts_of(std::max({side(0), side(1), side(2)}));
    const Eigen::Vector3d along = (corners[1] - corners[0]) / parts;
    const Eigen::Vector3d up = (corners[2] - corners[0]) / parts;
    for (int i = 0; i < parts; ++i) {
      for (int j = 0; i + j < parts; ++j) {
        look_at(corners[0] + (i + 1 / 3.0) * along + (j + 1 / 3.0) * up);
        if (i + j + 1 < parts) {
          look_at(corners[0] + (i + 2 / 3.0) * along + (j + 2 / 3.0) * up);
        }
      }
    }
  }
  return least;
}

double largest_eigenvalue(const Eigen::Matrix3d& stress) {
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(stress, Eigen::EigenvaluesOnly).eigenvalues()[2];
}

}  // namespace

Cracks::Cracks(const Surface& surface, const AblationOptions& options, const std::vector<double>& texture)
    : surface_(surface),
      options_(options),
      texture_(texture),
      element_strength_(surface.elements.local(), options.strength.value()),
      overload_(surface.of(Colour::blue).layout, 1),
      largest_overload_(surface.particles, 1) {
  for (std::size_t e = 0; e < element_strength_.size() && options.strength_scatter > 0; ++e) {
    element_strength_[e] *=
        1 + options.strength_scatter * least_noise(surface, e, options.seed, options.scatter_length);
  }
  if (options.strength_length > 0) {
    average_.emplace(surface, options.strength_length, options.solver_prefix);
  }
}

std::vector<PetscInt> Cracks::sides(const CrackInput& input) {
  const SpringSet& edges = surface_.of(Colour::blue);
  for (PetscInt s = 0; s < edges.owned(); ++s) {
    overload_.data()[s] = overload(input, s);
  }
  if (average_) {
    require_average_overload(input);
  }
  overload_.update_ghosts();
  largest_overload_.values().setZero();
  // Sides compete at their ends and in their elements: those of a quad at its lattice point; those of a triangle share
  // ends.
  const auto places = [&](PetscInt s) {
    std::array<PetscInt, 4> result{edges.ends[s][0], edges.ends[s][1], -1, -1};
    for (std::size_t t = 0; t < 2 && surface_.has_quads(); ++t) {
      const PetscInt side = edges.triangles[s][t];
      result[2 + t] = side < 0 ? -1 : surface_.lattice[side / 4];
    }
    return result;
  };
  for (PetscInt s = 0; s < edges.local(); ++s) {
    for (const PetscInt place : places(s)) {
      if (place >= 0) {
        double& largest = largest_overload_.data()[place];
        largest = std::max(largest, overload_.data()[s]);
      }
    }
  }
  // All springs at an owned particle, and along the sides of an owned quad, are local.
  largest_overload_.update_ghosts();
  // Ratios that differ by rounding alone count as equal, or the number of ranks would decide which side cracks.
  const double tie = 1 + 1e-6;
  std::vector<PetscInt> cracks;
  for (PetscInt s = 0; s < edges.owned(); ++s) {
    const double here = overload_.data()[s];
    const std::array<PetscInt, 4> of_side = places(s);
    if (here > 0 && is_counted_here(static_cast<std::size_t>(s)) &&
        std::all_of(of_side.begin(), of_side.end(),
                    [&](PetscInt place) { return place < 0 || here * tie >= largest_overload_.data()[place]; })) {
      cracks.push_back(s);
    }
  }
  return cracks;
}

std::string Cracks::remark() const {
  if (!average_ || average_->least_length() <= options_.strength_length) {
    return "";
  }
  return "where a clamp, a notch or a crack concentrates stress, the load that makes it crack depends on the mesh: "
         "cells average the stress over up to " +
         number_text(average_->least_length()) + " m by themselves, more than ablation.strength_length " +
         number_text(options_.strength_length) + " m";
}

/// Whether a side counts on this rank; each counts on one. Springs of quads have one owner; an edge of a membrane is
/// owned by all ranks that have it, and counts on the owner of its end of the lower id.
bool Cracks::is_counted_here(std::size_t blue) const {
  const auto [a, b] = surface_.of(Colour::blue).ends[blue];
  const auto id = [this](PetscInt particle) { return surface_.persistent_id[particle]; };
  return surface_.has_quads() || (id(a) < id(b) ? a : b) < surface_.particles.owned;
}

/// The strength of the side of elements along an owned blue spring.
Cracks::Strength Cracks::strength(const CrackInput& input, std::size_t blue) const {
  const auto [a, b] = surface_.of(Colour::blue).ends[blue];
  const auto left_at = [&](PetscInt particle) {
    const double least = input.min_mass;
    const double left = input.mass.data()[particle] / surface_.initial_mass[particle];
    // A material that loses no mass has no char.
    const double unburnt = least < 1 ? std::clamp((left - least) / (1 - least), 0.0, 1.0) : 1;
    return options_.char_strength + (1 - options_.char_strength) * unburnt;
  };
  const auto texture_at = [&](PetscInt particle) { return texture_.empty() ? 1 : texture_[particle]; };
  const double factor = (left_at(a) + left_at(b)) / 2 * (texture_at(a) + texture_at(b)) / 2;
  const auto [first, second] = surface_.sides_along(blue);
  const auto of_element = [&](PetscInt side) { return element_strength_[surface_.element_of_side(side)]; };
  return {factor * std::min(of_element(first), of_element(second)),
          factor * (of_element(first) + of_element(second)) / 2};
}

/// Stress across an owned blue spring's side over the strength; 0 where it cannot crack.
double Cracks::overload(const CrackInput& input, std::size_t blue) const {
  const auto [a, b] = surface_.of(Colour::blue).ends[blue];
  if (input.pinned[a] && input.pinned[b]) {
    return 0;
  }
  const Eigen::Vector3d along = (input.position.vector(b) - input.position.vector(a)).stableNormalized();
  Eigen::Matrix3d stress = Eigen::Matrix3d::Zero();
  double across = 0;
  for (const PetscInt of_element : surface_.sides_along(blue)) {
    const std::size_t side = of_element;
    if (of_element < 0 || !input.active.triangles[surface_.triangle_at(side)] || input.active.cracked[side]) {
      return 0;
    }
    const std::size_t element = surface_.element_of_side(side);
    const Eigen::Vector3d normal =
        along.cross(element_area_vector(surface_, input.position.data(), element)).stableNormalized();
    stress += input.stress[element] / 2;
    across += normal.dot(input.stress[element] * normal) / 2;
  }
  const Strength withstands = strength(input, blue);
  if (across <= 0 || stress.norm() <= withstands.weakest) {
    return 0;
  }
  const double principal = largest_eigenvalue(stress);
  constexpr double least_share = 0.25;  // up to 60 degrees: sides of other directions are nearer
  return principal > withstands.weakest && across >= least_share * principal ? across / withstands.mean : 0;
}

/// Keeps owned sides that could crack only if their average stress exceeds the strength, too. Collective.
void Cracks::require_average_overload(const CrackInput& input) {
  const auto owned = overload_.values().leftCols(surface_.of(Colour::blue).owned());
  if (!on_any_rank(surface_.comm(), (owned.array() > 0).any())) {
    return;
  }
  std::vector<double> tension;
  tension.reserve(input.stress.size());
  for (const Eigen::Matrix3d& stress : input.stress) {
    tension.push_back(std::max(largest_eigenvalue(stress), 0.0));
  }
  const std::vector<double> average = average_->of(tension, input.active);
  for (PetscInt s = 0; s < owned.cols(); ++s) {
    if (overload_.data()[s] > 0) {
      double stress = 0;
      for (const PetscInt side : surface_.sides_along(s)) {
        stress += average[surface_.element_of_side(side)] / 2;
      }
      if (stress <= strength(input, s).weakest) {
        overload_.data()[s] = 0;
      }
    }
  }
}

}  // namespace pellicle::ablation
