#include "prism/wall_potential.h"

#include <utility>

#include "geometry/pressure_load.h"
#include "prism/gradient_stiffness.h"

namespace pellicle::prism {

std::vector<VertexPair> pairs_of_elements(const Surface& surface) {
  std::vector<VertexPair> pairs;
  pairs.reserve(9 * surface.triangles.size());
  for (const std::array<PetscInt, 3>& triangle : surface.triangles) {
    for (const PetscInt i : triangle) {
      for (const PetscInt j : triangle) {
        pairs.push_back({i, surface.particles.to_global(j)});
      }
    }
  }
  return pairs;
}

WallPotential::WallPotential(const PrismElements& elements, const PrismOptions& options)
    : elements_(elements),
      blends_(options.tangent == ElementTangent::exact && !options.positive_elements),
      positive_(elements),
      thickness_ratio_(elements.membrane().triangles.size(), 1.0) {
  if (options.tangent == ElementTangent::exact) {
    exact_ = std::make_unique<MetricStiffness>(elements);
  } else {
    const bool is_papers = options.tangent == ElementTangent::paper;
    exact_ = std::make_unique<GradientStiffness>(elements, is_papers ? Director::left_out : Director::varied);
  }
  in_use_ = exact_.get();
}

void WallPotential::set_load(std::vector<double> pressure, std::vector<PetscInt> rims) {
  pressure_ = std::move(pressure);
  rims_ = std::move(rims);
}

void WallPotential::update_hessian(const Field& x, double psd_blend) {
  at_rims_.clear();
  if (psd_blend == Curvature::psd) {
    positive_.update(x, thickness_ratio_, {}, 1);
    in_use_ = &positive_;
    return;
  }
  std::vector<double> pressure = pressure_;
  for (double& p : pressure) {
    p *= 1 - psd_blend;
  }
  exact_->update(x, thickness_ratio_, pressure, blends_ ? psd_blend : 1);
  in_use_ = exact_.get();
  for (const PetscInt side : pressure.empty() ? std::vector<PetscInt>() : rims_) {
    const std::size_t element = side / 3;
    const auto& corners = elements_.membrane().triangles[element];
    const std::size_t k = side % 3;
    at_rims_.push_back(rim_stiffness(pressure[element], x.vector(corners[k]), x.vector(corners[(k + 1) % 3])));
  }
}

void WallPotential::add_hessian(const HessianBlocks& blocks) const {
  in_use_->add_blocks(1, blocks);
  for (std::size_t rim = 0; rim < at_rims_.size(); ++rim) {
    const std::size_t first = 9 * (rims_[rim] / 3);
    const std::size_t from = rims_[rim] % 3;
    const std::size_t to = (from + 1) % 3;
    blocks.add(first + 3 * from + to, at_rims_[rim]);
    blocks.add(first + 3 * to + from, at_rims_[rim]);
    blocks.add(first + 4 * from, 2 * at_rims_[rim]);
    blocks.add(first + 4 * to, 2 * at_rims_[rim]);
  }
}

void WallPotential::add_product(const double* w, double* result) const {
  in_use_->add_product(1, w, result);
  for (std::size_t rim = 0; rim < at_rims_.size(); ++rim) {
    const auto& corners = elements_.membrane().triangles[rims_[rim] / 3];
    const std::size_t k = rims_[rim] % 3;
    const PetscInt ends[2] = {3 * corners[k], 3 * corners[(k + 1) % 3]};
    const Eigen::Vector3d of_ends[2] = {Eigen::Map<const Eigen::Vector3d>(w + ends[0]),
                                        Eigen::Map<const Eigen::Vector3d>(w + ends[1])};
    for (std::size_t end = 0; end < 2; ++end) {
      Eigen::Map<Eigen::Vector3d>(result + ends[end]) += at_rims_[rim] * (2 * of_ends[end] + of_ends[1 - end]);
    }
  }
}

DampingPotential::DampingPotential(const PrismElements& elements, const std::vector<double>& mass,
                                   const PrismOptions& options)
    : membrane_(elements.membrane()),
      mass_(mass),
      mass_damping_(options.mass_damping),
      stiffness_damping_(options.stiffness_damping),
      stiffness_(elements) {}

void DampingPotential::begin_step(const Field& at, const std::vector<double>& thickness_ratio,
                                  const Eigen::Matrix3Xd& still, double rate) {
  y_v_ = still;
  rate_ = rate;
  if (multiplies()) {
    stiffness_.update(at, thickness_ratio, {}, 1);
  }
}

double DampingPotential::value(const Field& x) const {
  Eigen::Matrix3Xd gradient = Eigen::Matrix3Xd::Zero(3, membrane_.particles.owned);
  return add_value_and_gradient(x, gradient);
}

double DampingPotential::add_value_and_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const {
  const Eigen::Matrix3Xd displacement = x.values() - y_v_;
  Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, displacement.cols());  // c C (x - x_v), complete where owned
  add_product(displacement.data(), force.data());
  const PetscInt owned = membrane_.particles.owned;
  gradient += force.leftCols(owned);
  return force.leftCols(owned).cwiseProduct(displacement.leftCols(owned)).sum() / 2;
}

std::vector<VertexPair> DampingPotential::pattern() const {
  std::vector<VertexPair> pairs = multiplies() ? pairs_of_elements(membrane_) : std::vector<VertexPair>();
  const std::vector<VertexPair> single = diagonal_pairs(membrane_.particles);
  pairs.insert(pairs.end(), single.begin(), single.end());
  return pairs;
}

void DampingPotential::add_hessian(const HessianBlocks& blocks) const {
  std::size_t first = 0;  // of the pairs of single vertices
  if (multiplies()) {
    stiffness_.add_blocks(stiffness_damping_ * rate_, blocks);
    first = 9 * membrane_.triangles.size();
  }
  for (std::size_t i = 0; i < mass_.size(); ++i) {
    blocks.add(first + i, mass_damping_ * mass_[i] * rate_ * Eigen::Matrix3d::Identity());
  }
}

void DampingPotential::add_product(const double* w, double* result) const {
  for (std::size_t i = 0; i < mass_.size(); ++i) {
    Eigen::Map<Eigen::Vector3d>(result + 3 * i) +=
        mass_damping_ * mass_[i] * rate_ * Eigen::Map<const Eigen::Vector3d>(w + 3 * i);
  }
  if (multiplies()) {
    stiffness_.add_product(stiffness_damping_ * rate_, w, result);
  }
}

}  // namespace pellicle::prism
