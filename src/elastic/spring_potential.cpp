#include "elastic/spring_potential.h"

#include <petscsys.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "base/error.h"
#include "parallel/collective.h"
#include "surface/weave_strain.h"

namespace pellicle::elastic {

namespace {

/// Entry of a spring in data by colour and number.
template <class Spring, class Sets>
decltype(auto) of(const Spring& spring, Sets& sets) {
  return sets[static_cast<std::size_t>(spring.colour)][spring.number];
}

/// Successive values of StrainLimit::exact_to.
constexpr std::array exact_shares{0.5, 0.8, 0.95, 0.99};

}  // namespace

double StrainLimit::fraction(double length, double target) const {
  const double strain = length / target - 1;
  if (strain < 0 && largest >= 1) {
    return 0;
  }
  return (std::abs(strain) / largest - begins) / (1 - begins);
}

StrainLimit::Law StrainLimit::at(double length, double target) const {
  const double u = fraction(length, target);
  if (u <= 0) {
    return {};
  }
  const double at = std::min(u, exact_to);
  const double left = 1 - at;
  const double second = 6 * at / (left * left * left * left);                          // B''
  const double first = at * at * (3 - at) / (left * left * left) + second * (u - at);  // B'
  const double value = at * at * at / (left * left) + (first - second * (u - at) / 2) * (u - at);
  const double width = (1 - begins) * largest * target;  // l w
  const double direction = length > target ? 1 : -1;
  return {stiffness * width * width * value, direction * stiffness * width * first, stiffness * second};
}

SpringPotential::SpringPotential(const Sheet& sheet) : sheet_(&sheet) {
  for (const Colour colour : all_colours) {
    const SpringSet& set = sheet.of(colour);
    for (PetscInt s = 0; s < set.local(); ++s) {
      const auto [a, b] = std::minmax(set.ends[s][0], set.ends[s][1]);
      if (s < set.owned() || a < sheet.particles.owned) {
        springs_.push_back({a, b, s, colour, 0, set.initial_length[s], 0});
      }
    }
  }
  // Springs near each other in the sheet are near in memory: in the order of their ends.
  std::sort(springs_.begin(), springs_.end(), [](const Spring& one, const Spring& other) {
    return std::tie(one.a, one.b, one.colour, one.number) < std::tie(other.a, other.b, other.colour, other.number);
  });
  hessian_.reserve(springs_.size());
}

void SpringPotential::set_limit(const std::optional<StrainLimit>& limit,
                                const std::array<std::vector<double>, 4>& target_length,
                                const std::array<std::vector<bool>, 4>& lives) {
  limit_ = limit;
  for (Spring& spring : springs_) {
    spring.target = limit && is_of_weave(spring.colour) && of(spring, lives) ? of(spring, target_length) : 0;
  }
}

double SpringPotential::largest_share(const Field& x) const {
  double largest = 0;
  for (const Spring& spring : springs_) {
    if (is_owned(spring) && spring.target != 0) {
      largest = std::max(largest, limit_->fraction((x.vector(spring.a) - x.vector(spring.b)).norm(), spring.target));
    }
  }
  return max_over_ranks(sheet_->comm(), largest);
}

void SpringPotential::start_from(const Field& start, Field& /*x*/, double /*h*/) {
  if (limit_) {
    const double reached = largest_share(start);
    limit_->exact_to = reached > exact_shares.back()
                           ? exact_shares.front()
                           : *std::lower_bound(exact_shares.begin(), exact_shares.end(), reached);
  }
}

bool SpringPotential::refresh(const Field& x) {
  if (!limit_ || limit_->exact_to == exact_shares.back() || largest_share(x) <= limit_->exact_to) {
    return false;
  }
  limit_->exact_to = *std::upper_bound(exact_shares.begin(), exact_shares.end(), limit_->exact_to);
  return true;
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
  for (const Spring& spring : springs_) {
    if (is_owned(spring)) {
      of(spring, result) = law(spring, (x.vector(spring.a) - x.vector(spring.b)).norm()).slope;
    }
  }
  return result;
}

double SpringPotential::value(const Field& x) const {
  double sum = 0;
  for (const Spring& spring : springs_) {
    if (is_owned(spring) && spring.acts()) {
      sum += law(spring, (x.vector(spring.a) - x.vector(spring.b)).norm()).value;
    }
  }
  check(PetscLogFlops(12.0 * static_cast<double>(springs_.size())));
  return sum;
}

double SpringPotential::viscous_energy(const Field& x) const {
  double sum = 0;
  for (std::size_t s = 0; s < dashpots_.size(); ++s) {
    const Spring& spring = springs_[s];
    if (is_owned(spring) && dashpots_[s].stiffness > 0) {
      const double change = (x.vector(spring.a) - x.vector(spring.b)).norm() - dashpots_[s].length;
      sum += dashpots_[s].stiffness / 2 * change * change;
    }
  }
  return sum;
}

double SpringPotential::elastic_energy(const Field& x) const {
  double sum = value(x) - viscous_energy(x);
  for (std::size_t s = 0; s < dashpots_.size(); ++s) {  // What both together have where they are without force.
    const Spring& spring = springs_[s];
    const auto& [c, start] = dashpots_[s];
    if (is_owned(spring) && c > 0) {
      const double k = spring.stiffness - c;
      const double apart = spring.stiffness / k * (spring.length - start);
      sum += k * c / spring.stiffness / 2 * apart * apart;
    }
  }
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
    sum += is_owned(spring) ? energy.value : 0;
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

void SpringPotential::update_hessian(const Field& x, double psd_blend) {
  hessian_.clear();
  const double compressed = 1 - psd_blend;
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
    // Not negative: for Hooke's law it is k L / d, or k; the limit's slope grows faster than the stretch.
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
    const Eigen::Matrix3d block = (curved++)->block();
    const std::size_t pair = 4 * s;
    blocks.add(pair, block);
    blocks.add(pair + 1, -block);
    blocks.add(pair + 2, block);
    blocks.add(pair + 3, -block);
  }
}

}  // namespace pellicle::elastic
