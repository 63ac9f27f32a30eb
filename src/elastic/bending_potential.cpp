#include "elastic/bending_potential.h"

#include <petscsys.h>

#include <Eigen/Geometry>
#include <cmath>

#include "base/error.h"

namespace pellicle {
inline namespace elastic {

namespace {

Eigen::Map<const Eigen::Matrix3Xd> positions_of(const Field& x) { return {x.data(), 3, x.values().cols()}; }

}  // namespace

BendingPotential::BendingPotential(const Sheet& sheet, const Weave& weave, const std::vector<bool>& clamped)
    : sheet_(&sheet),
      stencils_(sheet, weave, clamped),
      target_(stencils_.stencils().size(), Curvature3::Zero()),
      stiffness_(stencils_.stencils().size(), Curvature3::Zero()),
      normal_(3, static_cast<Eigen::Index>(stencils_.stencils().size())) {}

BendingPotential::Bent BendingPotential::bend(std::size_t number, const Positions& x) const {
  const Stencil& stencil = stencils_.stencils()[number];
  Bent bent;
  bent.arms.setZero();
  for (std::size_t p = stencil.first; p < stencil.last; ++p) {
    bent.arms += x.col(stencils_.points()[p]) * stencils_.weights()[p].matrix().transpose();
  }
  const Eigen::Vector3d area = stencils_.area_vector(stencil, x);
  bent.doubled_area = area.norm();
  bent.normal = bent.doubled_area > 0 ? Eigen::Vector3d(area / bent.doubled_area) : Eigen::Vector3d::Zero();
  bent.excess = (bent.arms.transpose() * bent.normal).array() - target_[number];
  return bent;
}

void BendingPotential::begin_step(const Living& living, const Field& start, const Input& input) {
  stencils_.update(living);
  const double damped = 1 + input.damping_over_step;
  const Curvature3 by_direction(input.stiffness[0], 2 * std::sqrt(input.stiffness[0] * input.stiffness[1]),
                                input.stiffness[1]);
  for (std::size_t s = 0; s < stencils_.stencils().size(); ++s) {
    const Stencil& stencil = stencils_.stencils()[s];
    if (stencil.area == 0) {
      stiffness_[s].setZero();
      target_[s].setZero();
      continue;
    }
    std::array<double, 2> shrinkage{};  // of corners and lattice points
    std::array<double, 2> count{};
    double factor = 0;
    for (std::size_t p = stencil.first; p < stencil.last; ++p) {
      const auto i = static_cast<std::size_t>(stencils_.points()[p]);
      const std::size_t layer = sheet_->is_lattice[i] ? 1 : 0;
      shrinkage[layer] += input.shrinkage[i];
      ++count[layer];
      factor += input.factor[i];
    }
    shrinkage[0] /= count[0];
    shrinkage[1] /= count[1];
    factor /= count[0] + count[1];
    const double mean = (shrinkage[0] + shrinkage[1]) / 2;
    // B belongs to undeformed coordinates: the curvature of a sheet that has shrunk is B over the square of its share.
    const double curl = input.layer_distance > 0 ? (shrinkage[0] - shrinkage[1]) / input.layer_distance : 0;
    target_[s] = mean * stencil.rest + mean * mean * curl * Curvature3(1, 0, 1);
    stiffness_[s] = damped * factor * stencil.area / (mean * mean) * by_direction;
    if (input.damping_over_step > 0) {
      const Curvature3 before = bend(s, positions_of(start)).excess + target_[s];
      target_[s] = (target_[s] + input.damping_over_step * before) / damped;
    }
  }
}

double BendingPotential::value(const Field& x) const {
  double sum = 0;
  for (std::size_t s = 0; s < stiffness_.size(); ++s) {
    if (stencils_.stencils()[s].centre < sheet_->particles.owned && stencils_.stencils()[s].area > 0) {
      sum += (stiffness_[s] * bend(s, positions_of(x)).excess.square()).sum() / 2;
    }
  }
  check(PetscLogFlops(200.0 * static_cast<double>(stiffness_.size())));
  return sum;
}

void BendingPotential::add_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const {
  const PetscInt owned = sheet_->particles.owned;
  const Positions positions = positions_of(x);
  for (std::size_t s = 0; s < stiffness_.size(); ++s) {
    const Stencil& stencil = stencils_.stencils()[s];
    if (stencil.area == 0) {
      continue;
    }
    const Bent bent = bend(s, positions);
    if (bent.doubled_area == 0) {
      continue;
    }
    const Eigen::Vector3d moment = (stiffness_[s] * bent.excess).matrix();
    for (std::size_t p = stencil.first; p < stencil.last; ++p) {
      if (const PetscInt i = stencils_.points()[p]; i < owned) {
        gradient.col(i) += stencils_.weights()[p].matrix().dot(moment) * bent.normal;
      }
    }
    if (stencil.is_clamped) {
      continue;
    }
    const Eigen::Vector3d by_normal = bent.arms * moment;
    const Eigen::Vector3d by_area = (by_normal - bent.normal.dot(by_normal) * bent.normal) / bent.doubled_area;
    for (std::size_t t = stencil.first_triangle; t < stencil.last_triangle; ++t) {
      const auto& [a, b, c] = stencils_.triangles()[t];
      const Eigen::Vector3d to_b = positions.col(b) - positions.col(a);
      const Eigen::Vector3d to_c = positions.col(c) - positions.col(a);
      const Eigen::Vector3d at_b = to_c.cross(by_area);
      const Eigen::Vector3d at_c = by_area.cross(to_b);
      if (a < owned) {
        gradient.col(a) -= at_b + at_c;
      }
      if (b < owned) {
        gradient.col(b) += at_b;
      }
      if (c < owned) {
        gradient.col(c) += at_c;
      }
    }
  }
  check(PetscLogFlops(500.0 * static_cast<double>(stiffness_.size())));
}

std::vector<VertexPair> BendingPotential::pattern() const {
  std::vector<VertexPair> pairs;
  for (const Stencil& stencil : stencils_.stencils()) {
    for (std::size_t p = stencil.first; p < stencil.last; ++p) {
      for (std::size_t q = stencil.first; q < stencil.last; ++q) {
        pairs.push_back({stencils_.points()[p], sheet_->particles.to_global(stencils_.points()[q])});
      }
    }
  }
  return pairs;
}

void BendingPotential::update_hessian(const Field& x, Curvature /*curvature*/) {
  for (std::size_t s = 0; s < stiffness_.size(); ++s) {
    normal_.col(static_cast<Eigen::Index>(s)) =
        stencils_.area_vector(stencils_.stencils()[s], positions_of(x)).normalized();
  }
}

void BendingPotential::add_hessian(const HessianBlocks& blocks) const {
  std::size_t pair = 0;
  for (std::size_t s = 0; s < stiffness_.size(); ++s) {
    const Stencil& stencil = stencils_.stencils()[s];
    const auto n = normal_.col(static_cast<Eigen::Index>(s));
    const Eigen::Matrix3d projector = n * n.transpose();
    for (std::size_t p = stencil.first; p < stencil.last; ++p) {
      const Curvature3 weighted = stiffness_[s] * stencils_.weights()[p];
      for (std::size_t q = stencil.first; q < stencil.last; ++q) {
        blocks.add(pair++, (weighted * stencils_.weights()[q]).sum() * projector);
      }
    }
  }
}

void BendingPotential::add_product(const double* w, double* result) const {
  using Vector = Eigen::Map<Eigen::Vector3d>;
  using ConstVector = Eigen::Map<const Eigen::Vector3d>;
  for (std::size_t s = 0; s < stiffness_.size(); ++s) {
    const Stencil& stencil = stencils_.stencils()[s];
    if (stencil.area == 0) {
      continue;
    }
    const Eigen::Vector3d n = normal_.col(static_cast<Eigen::Index>(s));
    Curvature3 bent = Curvature3::Zero();
    for (std::size_t p = stencil.first; p < stencil.last; ++p) {
      bent += n.dot(ConstVector(w + 3 * stencils_.points()[p])) * stencils_.weights()[p];
    }
    bent *= stiffness_[s];
    for (std::size_t p = stencil.first; p < stencil.last; ++p) {
      Vector(result + 3 * stencils_.points()[p]) += (bent * stencils_.weights()[p]).sum() * n;
    }
  }
  check(PetscLogFlops(180.0 * static_cast<double>(stiffness_.size())));
}

}  // namespace elastic
}  // namespace pellicle
