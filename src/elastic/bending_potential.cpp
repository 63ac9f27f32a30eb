#include "elastic/bending_potential.h"

#include <petscsys.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "base/error.h"
#include "parallel/collective.h"

namespace pellicle::elastic {

namespace {

/// Share of the undeformed area vector below which the area vector of a sharp fold gives no good normal.
constexpr double sharp = 0.1;
constexpr double length_of_flat = 1 + sharp * sharp;  // squared: an unfolded sheet has a normal of length 1
/// Length of the mean of the normals round a particle below which these differ too much for one normal of its own.
constexpr double least_agreement = 0.9;
/// Viscosity, over stiffness times step, up to which the Hessian may have it in all directions.
constexpr double weak_damping = 1;

}  // namespace

BendingPotential::BendingPotential(const Sheet& sheet, const Eigen::Vector3d& warp, const std::vector<bool>& clamped)
    : sheet_(&sheet),
      stencils_(sheet, warp, clamped),
      target_(stencils_.stencils().size(), Curvature3::Zero()),
      stiffness_(stencils_.stencils().size(), Curvature3::Zero()),
      reference_(stencils_.stencils().size()) {
  rows_.normals = Field(sheet.particles, 3);
  const std::size_t owned = sheet.particles.owned;
  const std::vector<PetscInt>& points = stencils_.points();
  const auto visit_uses = [&](const auto& take) {
    for (std::size_t s = 0; s < stencils_.stencils().size(); ++s) {
      const Stencil& stencil = stencils_.stencils()[s];
      for (std::size_t p = stencil.first; p < stencil.last && !stencil.is_clamped; ++p) {
        if (const std::size_t i = points[p]; i < owned) {
          take(i, Use{static_cast<PetscInt>(s), static_cast<PetscInt>(p - stencil.first)});
        }
      }
    }
  };
  first_use_.assign(owned + 1, 0);
  visit_uses([&](std::size_t i, const Use& /*use*/) { ++first_use_[i + 1]; });
  std::partial_sum(first_use_.begin(), first_use_.end(), first_use_.begin());
  uses_.resize(first_use_.back());
  std::vector<std::size_t> next = first_use_;
  visit_uses([&](std::size_t i, const Use& use) { uses_[next[i]++] = use; });
  for (std::size_t s = 0; s < stencils_.stencils().size(); ++s) {
    if (stencils_.stencils()[s].is_clamped) {
      clamped_.push_back(s);
    }
  }
  std::vector<PetscInt> last_row(sheet.particles.local(), -1);
  rows_.columns.reserve(13 * owned);  // of a regular net
  rows_.offsets.reserve(owned + 1);
  for (std::size_t i = 0; i < owned; ++i) {
    const auto row = static_cast<PetscInt>(i);
    for (std::size_t u = first_use_[i]; u < first_use_[i + 1]; ++u) {
      const Stencil& stencil = stencils_.stencils()[uses_[u].stencil];
      for (std::size_t q = stencil.first; q < stencil.last; ++q) {
        const PetscInt j = points[q];
        if (j >= row && std::exchange(last_row[j], row) != row) {
          rows_.columns.push_back(j);
        }
      }
    }
    std::sort(rows_.columns.begin() + rows_.offsets.back(), rows_.columns.end());
    rows_.offsets.push_back(static_cast<PetscInt>(rows_.columns.size()));
  }
  rows_.entries.assign(rows_.columns.size(), 0);
  sums_.assign(last_row.size(), 0);
}

void BendingPotential::update_hessian(const Field& /*x*/, double /*psd_blend*/) {
  // A crack may change the weights and leave every stiffness as it is.
  bool is_same = fits_of_rows_ == stencils_.fits() && rows_of_.size() == stiffness_.size();
  rows_of_.resize(stiffness_.size());
  const double factor = 1 + damping_ - rows_.along;  // with viscosity in all directions
  for (std::size_t s = 0; s < stiffness_.size(); ++s) {
    const Curvature3 stiffness = factor * stiffness_[s];
    is_same = is_same && (rows_of_[s] == stiffness).all();
    rows_of_[s] = stiffness;
  }
  if (is_same) {
    return;
  }
  fits_of_rows_ = stencils_.fits();
  for (std::size_t i = 0; i + 1 < first_use_.size(); ++i) {
    const auto row = static_cast<PetscInt>(i);
    for (std::size_t u = first_use_[i]; u < first_use_[i + 1]; ++u) {
      const std::size_t s = uses_[u].stencil;
      const Stencil& stencil = stencils_.stencils()[s];
      const Curvature3 weighted =
          rows_of_[s] * stencils_.weights()[stencil.first + static_cast<std::size_t>(uses_[u].point)];
      for (std::size_t q = stencil.first; q < stencil.last; ++q) {
        if (const PetscInt j = stencils_.points()[q]; j >= row) {
          sums_[j] += (weighted * stencils_.weights()[q]).sum();
        }
      }
    }
    for (std::size_t k = rows_.offsets[i]; k < static_cast<std::size_t>(rows_.offsets[i + 1]); ++k) {
      rows_.entries[k] = std::exchange(sums_[rows_.columns[k]], 0);
    }
  }
}

void BendingPotential::begin_step(const ActiveSet& active, const Field& start, const Input& input) {
  stencils_.update(active);
  damping_ = input.damping_over_step;
  if (is_damped()) {
    dashpots_.resize(stiffness_.size());
  }
  const Curvature3 by_direction(input.stiffness[0], 2 * std::sqrt(input.stiffness[0] * input.stiffness[1]),
                                input.stiffness[1]);
  for (std::size_t s = 0; s < stencils_.stencils().size(); ++s) {
    const Stencil& stencil = stencils_.stencils()[s];
    target_[s].setZero();
    stiffness_[s].setZero();
    if (stencil.area == 0) {
      continue;
    }
    std::array<double, 2> shrinkage{};  // of corners and lattice points
    std::array<double, 2> count{};
    double factor = 0;
    for (std::size_t p = stencil.first; p < stencil.last; ++p) {
      if (!stencils_.takes_part(p)) {
        continue;
      }
      const std::size_t i = stencils_.points()[p];
      const std::size_t layer = sheet_->is_lattice[i] ? 1 : 0;
      shrinkage[layer] += input.shrinkage[i];
      ++count[layer];
      factor += input.factor[i];
    }
    shrinkage[0] /= count[0];
    shrinkage[1] /= count[1];
    factor /= count[0] + count[1];
    const double mean = (shrinkage[0] + shrinkage[1]) / 2;
    // B belongs to undeformed coordinates: the curvature of a sheet that has shrunk is B over the square of its
    // fraction.
    const double curl = input.layer_distance > 0 ? (shrinkage[0] - shrinkage[1]) / input.layer_distance : 0;
    target_[s] = mean * stencil.rest + mean * mean * curl * Curvature3(1, 0, 1);
    stiffness_[s] = factor * stencil.area / (mean * mean) * by_direction;
    reference_[s] = mean * mean * stencils_.area_vector(stencil, sheet_->rest.data()).norm();
    if (is_damped()) {
      Dashpot& dashpot = dashpots_[s];
      dashpot.normal = normal_at(s, start).direction;
      dashpot.start = (second_derivatives(stencil, start).transpose() * dashpot.normal).array();
    }
  }
  rows_.along = is_damped() && (find_normals() || damping_ > weak_damping) ? damping_ : 0;
}

/// Sets the mean normal of the dashpots round each particle. Collective. @returns whether these normals are similar
/// everywhere
bool BendingPotential::find_normals() {
  const PetscInt owned = sheet_->particles.owned;
  Field& normals = rows_.normals;
  normals.values().setZero();
  number_of_normals_.assign(owned, 0);
  for (std::size_t s = 0; s < stiffness_.size(); ++s) {
    const Stencil& stencil = stencils_.stencils()[s];
    for (std::size_t p = stencil.first; p < stencil.last && stencil.area > 0 && !stencil.is_clamped; ++p) {
      if (const PetscInt i = stencils_.points()[p]; i < owned) {
        normals.vector(i) += dashpots_[s].normal;
        ++number_of_normals_[i];
      }
    }
  }
  bool differ = false;
  for (PetscInt i = 0; i < owned; ++i) {
    differ = differ || normals.vector(i).norm() < least_agreement * number_of_normals_[i];
    normals.vector(i).normalize();  // 0 stays 0.
  }
  normals.update_ghosts();
  return !on_any_rank(sheet_->comm(), differ);
}

BendingPotential::Normal BendingPotential::normal_at(std::size_t number, const Field& x) const {
  const Stencil& stencil = stencils_.stencils()[number];
  const Eigen::Vector3d area = stencils_.area_vector(stencil, x.data());
  Normal normal;
  if (stencil.is_clamped) {
    normal.direction = area.normalized();
    return normal;
  }
  const double kept = sharp * reference_[number];
  normal.length = std::sqrt((area.squaredNorm() + kept * kept) / length_of_flat);
  normal.direction = area / normal.length;
  return normal;
}

Eigen::Matrix3d BendingPotential::second_derivatives(const Stencil& stencil, const Field& x) const {
  Eigen::Matrix3d result = Eigen::Matrix3d::Zero();
  for (std::size_t p = stencil.first; p < stencil.last; ++p) {
    result += x.vector(stencils_.points()[p]) * stencils_.weights()[p].matrix().transpose();
  }
  return result;
}

Eigen::Matrix3d BendingPotential::residual(std::size_t number, const Eigen::Matrix3d& second_derivatives,
                                           const Field& x, Normal& normal) const {
  Eigen::Matrix3d result = second_derivatives;
  if (needs_normal(number)) {
    normal = normal_at(number, x);
    if (stencils_.stencils()[number].is_clamped) {
      result = normal.direction * (normal.direction.transpose() * result).eval();
    }
    result -= normal.direction * target_[number].matrix().transpose();
  }
  return result;
}

double BendingPotential::value(const Field& x) const {
  double sum = 0;
  Normal normal;
  for (std::size_t s = 0; s < stiffness_.size(); ++s) {
    const Stencil& stencil = stencils_.stencils()[s];
    if (stencil.centre < sheet_->particles.owned && stencil.area > 0) {
      const Eigen::Matrix3d bent = second_derivatives(stencil, x);
      sum += energy(s, bent, residual(s, bent, x, normal));
    }
  }
  check(PetscLogFlops(200.0 * static_cast<double>(stiffness_.size())));
  return sum;
}

double BendingPotential::viscous_energy(const Field& x) const {
  double sum = 0;
  for (std::size_t s = 0; is_damped() && s < stiffness_.size(); ++s) {
    const Stencil& stencil = stencils_.stencils()[s];
    if (stencil.centre < sheet_->particles.owned && stencil.area > 0) {
      const Eigen::Matrix3d bent = second_derivatives(stencil, x);
      sum += damping_ * (stiffness_[s] * dashpots_[s].change(bent).square()).sum() / 2;
    }
  }
  return sum;
}

double BendingPotential::energy(std::size_t number, const Eigen::Matrix3d& bent,
                                const Eigen::Matrix3d& residual) const {
  const Eigen::Array3d squares = residual.colwise().squaredNorm().transpose();
  double sum = (stiffness_[number] * squares).sum() / 2;
  if (is_damped()) {
    sum += damping_ * (stiffness_[number] * dashpots_[number].change(bent).square()).sum() / 2;
  }
  return sum;
}

double BendingPotential::add_value_and_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const {
  const PetscInt owned = sheet_->particles.owned;
  double sum = 0;
  Normal normal;
  for (std::size_t s = 0; s < stiffness_.size(); ++s) {
    const Stencil& stencil = stencils_.stencils()[s];
    if (stencil.area == 0) {
      continue;
    }
    const Eigen::Matrix3d bent = second_derivatives(stencil, x);
    const Eigen::Matrix3d off_target = residual(s, bent, x, normal);
    sum += stencil.centre < owned ? energy(s, bent, off_target) : 0;
    const Eigen::Matrix3d moments = off_target * stiffness_[s].matrix().asDiagonal();
    Eigen::Matrix3d all_moments = moments;
    if (is_damped()) {
      const Dashpot& dashpot = dashpots_[s];
      all_moments += damping_ * dashpot.normal * (stiffness_[s] * dashpot.change(bent)).matrix().transpose();
    }
    for (std::size_t p = stencil.first; p < stencil.last; ++p) {
      if (const PetscInt i = stencils_.points()[p]; i < owned) {
        gradient.col(i) += all_moments * stencils_.weights()[p].matrix();
      }
    }
    if (stencil.is_clamped || !needs_normal(s)) {
      continue;
    }
    const Eigen::Vector3d by_normal = -moments * target_[s].matrix();
    const Eigen::Vector3d by_area =
        (by_normal - normal.direction.dot(by_normal) / length_of_flat * normal.direction) / normal.length;
    stencils_.visit_triangles(stencil, [&](const std::array<PetscInt, 3>& triangle) {
      const auto [a, b, c] = triangle;
      const auto [to_b, to_c] = edges_of(x.data(), triangle);
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
    });
  }
  check(PetscLogFlops(320.0 * static_cast<double>(stiffness_.size())));
  return sum;
}

std::vector<VertexPair> BendingPotential::pattern() const {
  std::vector<VertexPair> pairs;
  for (PetscInt i = 0; i < sheet_->particles.owned; ++i) {
    for (PetscInt k = rows_.offsets[i]; k < rows_.offsets[static_cast<std::size_t>(i) + 1]; ++k) {
      const PetscInt j = rows_.columns[k];
      pairs.push_back({i, sheet_->particles.to_global(j)});
      pairs.push_back({j, sheet_->particles.to_global(i)});
    }
  }
  visit_clamped([&](PetscInt i, PetscInt j, const Eigen::Matrix3d& /*block*/) {
    pairs.push_back({i, sheet_->particles.to_global(j)});
  });
  return pairs;
}

void BendingPotential::add_hessian(const HessianBlocks& blocks) const {
  std::size_t pair = 0;
  for (PetscInt i = 0; i < sheet_->particles.owned; ++i) {
    for (std::size_t k = rows_.offsets[i]; k < static_cast<std::size_t>(rows_.offsets[static_cast<std::size_t>(i) + 1]);
         ++k) {
      const Eigen::Matrix3d block = rows_.block(i, k);
      blocks.add(pair++, block);
      if (rows_.columns[k] != i) {
        blocks.add(pair, block.transpose());
      }
      ++pair;
    }
  }
  visit_clamped([&](PetscInt /*i*/, PetscInt /*j*/, const Eigen::Matrix3d& block) { blocks.add(pair++, block); });
}

void BendingPotential::visit(HessianTerms& terms) const {
  const PetscInt owned = sheet_->particles.owned;
  terms.add_numbers(rows_);
  visit_clamped([&](PetscInt i, PetscInt j, const Eigen::Matrix3d& block) {
    if (i < owned) {
      terms.add_block(i, j, block);
    }
  });
}

template <class Take>
void BendingPotential::visit_clamped(const Take& take) const {
  for (const std::size_t s : clamped_) {
    const Stencil& stencil = stencils_.stencils()[s];
    const Eigen::Vector3d n = stencils_.area_vector(stencil, sheet_->rest.data()).normalized();
    for (std::size_t p = stencil.first; p < stencil.last; ++p) {
      const Curvature3 weighted = (1 + damping_) * stiffness_[s] * stencils_.weights()[p];
      for (std::size_t q = stencil.first; q < stencil.last; ++q) {
        take(stencils_.points()[p], stencils_.points()[q],
             (weighted * stencils_.weights()[q]).sum() * n * n.transpose());
      }
    }
  }
}

}  // namespace pellicle::elastic
