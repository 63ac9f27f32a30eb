#include "elastic/spring_potential.h"

#include <petscsys.h>

#include <algorithm>

#include "base/error.h"

namespace pellicle {
inline namespace elastic {

SpringPotential::SpringPotential(const Sheet& sheet) : sheet_(&sheet) {
  const PetscInt owned = sheet.particles.owned;
  for (const Colour colour : all_colours) {
    const SpringSet& set = sheet.of(colour);
    for (std::size_t s = 0; s < set.ends.size(); ++s) {
      const auto [a, b] = set.ends[s];
      const bool is_owned = s < static_cast<std::size_t>(set.owned());
      if (is_owned) {
        owned_.push_back(springs_.size());
      }
      if (is_owned || a < owned || b < owned) {
        number_[static_cast<std::size_t>(colour)].push_back(s);
        springs_.push_back({a, b, 0, set.initial_length[s]});
      }
    }
  }
  hessian_.resize(springs_.size());
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

std::array<std::vector<double>, 4> SpringPotential::forces(const Field& x) const {
  std::array<std::vector<double>, 4> result;
  for (const Colour colour : all_colours) {
    result[static_cast<std::size_t>(colour)].assign(static_cast<std::size_t>(sheet_->of(colour).owned()), 0);
  }
  auto spring = springs_.begin();
  for (const Colour colour : all_colours) {
    std::vector<double>& of_colour = result[static_cast<std::size_t>(colour)];
    for (const std::size_t s : number_[static_cast<std::size_t>(colour)]) {
      const auto& [a, b, stiffness, length] = *spring++;
      if (s < of_colour.size()) {
        of_colour[s] = stiffness * ((x.vector(a) - x.vector(b)).norm() - length);
      }
    }
  }
  return result;
}

double SpringPotential::value(const Field& x) const {
  double sum = 0;
  for (const std::size_t s : owned_) {
    const auto& [a, b, stiffness, length] = springs_[s];
    const double stretch = (x.vector(a) - x.vector(b)).norm() - length;
    sum += stiffness / 2 * stretch * stretch;
  }
  check(PetscLogFlops(12.0 * static_cast<double>(owned_.size())));
  return sum;
}

void SpringPotential::add_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const {
  const PetscInt owned = sheet_->particles.owned;
  for (const auto& [a, b, stiffness, length] : springs_) {
    const Eigen::Vector3d arm = x.vector(a) - x.vector(b);
    const double d = arm.norm();
    if (stiffness == 0 || d == 0) {
      continue;
    }
    const Eigen::Vector3d force = stiffness * (1 - length / d) * arm;
    if (a < owned) {
      gradient.col(a) += force;
    }
    if (b < owned) {
      gradient.col(b) -= force;
    }
  }
  check(PetscLogFlops(19.0 * static_cast<double>(springs_.size())));
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
  for (std::size_t s = 0; s < springs_.size(); ++s) {
    const auto& [a, b, stiffness, length] = springs_[s];
    const Eigen::Vector3d arm = x.vector(a) - x.vector(b);
    const double d = arm.norm();
    if (stiffness == 0 || d == 0) {
      hessian_[s] = {Eigen::Vector3d::Zero(), 0};
      continue;
    }
    double across = stiffness * (1 - length / d);
    if (curvature == Curvature::positive) {
      across = std::max(0.0, across);
    }
    // k - across is not negative: k L / d at most, or k.
    hessian_[s] = {std::sqrt(stiffness - across) / d * arm, across};
  }
  check(PetscLogFlops(17.0 * static_cast<double>(springs_.size())));
}

void SpringPotential::add_hessian(const HessianBlocks& blocks) const {
  std::size_t pair = 0;
  for (const auto& [direction, across] : hessian_) {
    Eigen::Matrix3d block = direction * direction.transpose();
    block.diagonal().array() += across;
    blocks.add(pair++, block);
    blocks.add(pair++, -block);
    blocks.add(pair++, block);
    blocks.add(pair++, -block);
  }
}

void SpringPotential::add_product(const double* w, double* result) const {
  using Vector = Eigen::Map<Eigen::Vector3d>;
  using ConstVector = Eigen::Map<const Eigen::Vector3d>;
  for (std::size_t s = 0; s < springs_.size(); ++s) {
    if (springs_[s].stiffness == 0) {
      continue;
    }
    const PetscInt a = springs_[s].a;
    const PetscInt b = springs_[s].b;
    const auto& [direction, across] = hessian_[s];
    const Eigen::Vector3d difference = ConstVector(w + 3 * a) - ConstVector(w + 3 * b);
    const Eigen::Vector3d force = direction.dot(difference) * direction + across * difference;
    Vector(result + 3 * a) += force;
    Vector(result + 3 * b) -= force;
  }
  check(PetscLogFlops(23.0 * static_cast<double>(springs_.size())));
}

}  // namespace elastic
}  // namespace pellicle
