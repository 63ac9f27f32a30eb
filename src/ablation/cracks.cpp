#include "ablation/cracks.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>

#include "base/noise.h"
#include "geometry/quad_area.h"

namespace pellicle {
inline namespace ablation {

namespace {

/// One number for each pair of ids, the same in either order.
std::uint64_t number_of_pair(PetscInt a, PetscInt b) {
  return (static_cast<std::uint64_t>(std::min(a, b)) << 32) + static_cast<std::uint64_t>(std::max(a, b));
}

/// A vector along the normal of a local element.
Eigen::Vector3d normal_of(const Surface& surface, const Field& position, std::size_t element) {
  const auto corner = [&](std::size_t k) { return position.vector(surface.corner(element, k)); };
  return surface.has_quads() ? quad_area_vector(corner(0), corner(1), corner(2), corner(3))
                             : Eigen::Vector3d((corner(1) - corner(0)).cross(corner(2) - corner(0)));
}

}  // namespace

double share_of_strength(double mass_ratio, double min_mass, double char_strength) {
  // A material that loses no mass has no char.
  const double unburnt = min_mass < 1 ? std::clamp((mass_ratio - min_mass) / (1 - min_mass), 0.0, 1.0) : 1;
  return char_strength + (1 - char_strength) * unburnt;
}

Cracks::Cracks(const Surface& surface, const AblationOptions& options, const std::vector<double>& texture)
    : surface_(surface),
      char_strength_(options.char_strength),
      overload_(surface.of(Colour::blue).layout, 1),
      largest_overload_(surface.particles, 1) {
  const SpringSet& edges = surface.of(Colour::blue);
  for (std::size_t s = 0; s < static_cast<std::size_t>(edges.owned()); ++s) {
    const auto a = static_cast<std::size_t>(edges.ends[s][0]);
    const auto b = static_cast<std::size_t>(edges.ends[s][1]);
    const auto id = [&](PetscInt side) {
      return side < 0 ? 0 : surface.element_id[surface.element_of_side(static_cast<std::size_t>(side))];
    };
    // Uses the ids of the elements, which stay when corners double.
    const auto [first, second] = surface.sides_along(s);
    const double random = noise(options.seed, number_of_pair(id(first), id(second)));
    unburnt_strength_.push_back(options.strength.value() * (1 + options.strength_scatter * random) *
                                (texture.empty() ? 1 : (texture[a] + texture[b]) / 2));
  }
}

std::vector<PetscInt> Cracks::sides(const CrackInput& input) {
  const SpringSet& edges = surface_.of(Colour::blue);
  for (std::size_t s = 0; s < static_cast<std::size_t>(edges.owned()); ++s) {
    overload_.data()[s] = overload(input, s);
  }
  overload_.update_ghosts();
  largest_overload_.values().setZero();
  // Sides compete with each other at their ends and in their elements: those of a quad at its lattice point; those of a
  // triangle have ends in common anyway.
  const auto places = [&](PetscInt s) {
    const auto k = static_cast<std::size_t>(s);
    std::array<PetscInt, 4> result{edges.ends[k][0], edges.ends[k][1], -1, -1};
    for (std::size_t t = 0; t < 2 && surface_.has_quads(); ++t) {
      const PetscInt side = edges.triangles[k][t];
      result[2 + t] = side < 0 ? -1 : surface_.lattice[static_cast<std::size_t>(side / 4)];
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

/// Each side counts once: springs of quads are owned by one rank; an edge of a membrane is owned by every rank that has
/// it, and counts on the rank that owns its end of the lower id.
bool Cracks::is_counted_here(std::size_t blue) const {
  const auto [a, b] = surface_.of(Colour::blue).ends[blue];
  const auto id = [this](PetscInt particle) { return surface_.persistent_id[static_cast<std::size_t>(particle)]; };
  return surface_.has_quads() || (id(a) < id(b) ? a : b) < surface_.particles.owned;
}

/// Stress across an owned blue spring's side over the strength; 0 where it cannot crack.
double Cracks::overload(const CrackInput& input, std::size_t blue) const {
  const auto [a, b] = surface_.of(Colour::blue).ends[blue];
  if (input.pinned[static_cast<std::size_t>(a)] && input.pinned[static_cast<std::size_t>(b)]) {
    return 0;
  }
  const Eigen::Vector3d along = (input.position.vector(b) - input.position.vector(a)).stableNormalized();
  Eigen::Matrix3d stress = Eigen::Matrix3d::Zero();
  double across = 0;
  for (const PetscInt of_element : surface_.sides_along(blue)) {
    const auto side = static_cast<std::size_t>(of_element);
    if (of_element < 0 || !input.living.triangles[surface_.triangle_at(side)] || input.living.cracked[side]) {
      return 0;
    }
    const std::size_t element = surface_.element_of_side(side);
    const Eigen::Vector3d normal = along.cross(normal_of(surface_, input.position, element)).stableNormalized();
    stress += input.stress[element] / 2;
    across += normal.dot(input.stress[element] * normal) / 2;
  }
  const auto share_at = [&](PetscInt particle) {
    const double left = input.mass.data()[particle] / surface_.initial_mass[static_cast<std::size_t>(particle)];
    return share_of_strength(left, input.min_mass, char_strength_);
  };
  const double strength = unburnt_strength_[blue] * (share_at(a) + share_at(b)) / 2;
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
