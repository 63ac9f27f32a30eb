#include "elastic/spring_potential.h"

#include <petscsys.h>

#include <algorithm>

#include "base/error.h"
#include "surface/net_strain.h"

namespace pellicle {
inline namespace elastic {

SpringPotential::SpringPotential(const Sheet& sheet) : sheet_(&sheet) {
  const PetscInt owned = sheet.particles.owned;
  for (const Colour colour : all_colours) {
    const SpringSet& set = sheet.of(colour);
    for (std::size_t s = 0; s < set.ends.size(); ++s) {
      const auto [a, b] = set.ends[s];
      const bool is_owned = s < static_cast<std::size_t>(set.owned());
      if (is_owned || a < owned || b < owned) {
        number_[static_cast<std::size_t>(colour)].push_back(s);
        springs_.push_back({a, b, 0, set.initial_length[s], 0, is_owned});
      }
    }
  }
  hessian_.reserve(springs_.size());
}

void SpringPotential::set(const std::array<std::vector<double>, 4>& stiffness,
                          const std::array<std::vector<double>, 4>& length) {
  auto spring = springs_.begin();
  for (const Colour colour_of_spring : all_colours) {
    const auto colour = static_cast<std::size_t>(colour_of_spring);
    for (const std::size_t s : number_[colour]) {
      spring->stiffness = stiffness[colour][s];
      spring->length = length[colour][s];
      ++spring;
    }
  }
}

void SpringPotential::set_limit(const std::optional<StrainLimit>& limit,
                                const std::array<std::vector<double>, 4>& target_length,
                                const std::array<std::vector<bool>, 4>& lives) {
  limit_ = limit;
  auto spring = springs_.begin();
  for (const Colour colour_of_spring : all_colours) {
    const auto colour = static_cast<std::size_t>(colour_of_spring);
    const bool is_limited = limit && is_of_net(colour_of_spring);
    for (const std::size_t s : number_[colour]) {
      spring->target = is_limited && lives[colour][s] ? target_length[colour][s] : 0;
      ++spring;
    }
  }
}

double SpringPotential::largest_share(const Field& x) const {
  double largest = 0;
  for (const Spring& spring : springs_) {
    if (spring.is_owned && spring.target != 0) {
      largest = std::max(largest, limit_->share((x.vector(spring.a) - x.vector(spring.b)).norm(), spring.target));
    }
  }
  return largest;
}

StrainLimit::Law SpringPotential::law(const Spring& spring, double length) const {
  const double stretch = length - spring.length;
  StrainLimit::Law law{spring.stiffness / 2 * stretch * stretch, spring.stiffness * stretch, spring.stiffness};
  if (spring.target != 0) {
    const StrainLimit::Law limit = limit_->at(length, spring.target);
    law.value += limit.value;
    law.slope += limit.slope;
    law.curvature += limit.curvature;
  }
  return law;
}

std::array<std::vector<double>, 4> SpringPotential::forces(const Field& x) const {
  std::array<std::vector<double>, 4> result;
  for (const Colour colour : all_colours) {
    result[static_cast<std::size_t>(colour)].assign(static_cast<std::size_t>(sheet_->of(colour).owned()), 0);
  }
  auto spring = springs_.begin();
  for (const Colour colour : all_colours) {
    std::vector<double>& of_colour = result[static_cast<std::size_t>(colour)];
    for (const std::size_t s : number_[static_cast<std::size_t>(colour)]) {
      if (s < of_colour.size()) {
        of_colour[s] = law(*spring, (x.vector(spring->a) - x.vector(spring->b)).norm()).slope;
      }
      ++spring;
    }
  }
  return result;
}

double SpringPotential::value(const Field& x) const {
  double sum = 0;
  for (const Spring& spring : springs_) {
    if (spring.is_owned && spring.acts()) {
      sum += law(spring, (x.vector(spring.a) - x.vector(spring.b)).norm()).value;
    }
  }
  check(PetscLogFlops(12.0 * static_cast<double>(springs_.size())));
  return sum;
}

double SpringPotential::add_value_and_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const {
  const PetscInt owned = sheet_->particles.owned;
  double sum = 0;
  for (const Spring& spring : springs_) {
    if (!spring.acts()) {
      continue;
    }
    const Eigen::Vector3d arm = x.vector(spring.a) - x.vector(spring.b);
    const double d = arm.norm();
    const StrainLimit::Law energy = law(spring, d);
    sum += spring.is_owned ? energy.value : 0;
    if (d == 0) {
      continue;
    }
    const Eigen::Vector3d force = energy.slope / d * arm;
    if (spring.a < owned) {
      gradient.col(spring.a) += force;
    }
    if (spring.b < owned) {
      gradient.col(spring.b) -= force;
    }
  }
  check(PetscLogFlops(22.0 * static_cast<double>(springs_.size())));
  return sum;
}

std::vector<VertexPair> SpringPotential::pattern() const {
  std::vector<VertexPair> pairs;
  for (const Spring& spring : springs_) {
    const PetscInt a = sheet_->particles.to_global(spring.a);
    const PetscInt b = sheet_->particles.to_global(spring.b);
    pairs.insert(pairs.end(), {{spring.a, a}, {spring.a, b}, {spring.b, b}, {spring.b, a}});
  }
  return pairs;
}

void SpringPotential::update_hessian(const Field& x, Curvature curvature) {
  hessian_.clear();
  const double compressed = curvature == Curvature::positive ? 0 : 1 - positive_share_;
  for (const Spring& spring : springs_) {
    if (!spring.acts()) {
      continue;
    }
    DifferenceTerm& curved = hessian_.emplace_back();
    curved.a = spring.a;
    curved.b = spring.b;
    const Eigen::Vector3d arm = x.vector(spring.a) - x.vector(spring.b);
    const double d = arm.norm();
    if (d == 0) {
      continue;
    }
    const StrainLimit::Law energy = law(spring, d);
    curved.across = energy.slope / d;
    if (curved.across < 0) {
      curved.across *= compressed;
    }
    // Not negative: of Hooke's law it is k L / d, or k; the limit's slope grows faster than the stretch.
    curved.direction = std::sqrt(std::max(0.0, energy.curvature - curved.across)) / d * arm;
  }
  check(PetscLogFlops(17.0 * static_cast<double>(hessian_.size())));
}

void SpringPotential::add_hessian(const HessianBlocks& blocks) const {
  auto curved = hessian_.begin();
  for (std::size_t s = 0; s < springs_.size(); ++s) {
    if (!springs_[s].acts()) {
      continue;
    }
    Eigen::Matrix3d block = curved->direction * curved->direction.transpose();
    block.diagonal().array() += curved->across;
    ++curved;
    const std::size_t pair = 4 * s;
    blocks.add(pair, block);
    blocks.add(pair + 1, -block);
    blocks.add(pair + 2, block);
    blocks.add(pair + 3, -block);
  }
}

void SpringPotential::add_product(const double* w, double* result) const {
  using Vector = Eigen::Map<Eigen::Vector3d>;
  using ConstVector = Eigen::Map<const Eigen::Vector3d>;
  for (const DifferenceTerm& spring : hessian_) {
    const Eigen::Vector3d difference = ConstVector(w + 3 * spring.a) - ConstVector(w + 3 * spring.b);
    const Eigen::Vector3d force = spring.direction.dot(difference) * spring.direction + spring.across * difference;
    Vector(result + 3 * spring.a) += force;
    Vector(result + 3 * spring.b) -= force;
  }
  check(PetscLogFlops(23.0 * static_cast<double>(hessian_.size())));
}

}  // namespace elastic
}  // namespace pellicle
