#include "prism/wall_potential.h"

#include <utility>

#include "geometry/pressure_load.h"
#include "prism/gradient_stiffness.h"

namespace pellicle::prism {

namespace {

/// @param blended set to the returned object, if it is exact and can be moved to its positive part by a fraction
std::unique_ptr<ElementStiffness> make_stiffness(const PrismElements& elements, const PrismOptions& options,
                                                 MetricStiffness*& blended) {
  if (options.tangent == ElementTangent::exact) {
    auto stiffness = std::make_unique<MetricStiffness>(elements, options.positive_elements);
    blended = options.positive_elements ? nullptr : stiffness.get();
    return stiffness;
  }
  return std::make_unique<GradientStiffness>(
      elements, options.tangent == ElementTangent::paper ? Director::left_out : Director::varied);
}

}  // namespace

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
      exact_(make_stiffness(elements, options, blended_)),
      positive_(elements, true),
      in_use_(exact_.get()),
      thickness_ratio_(elements.membrane().triangles.size(), 1.0) {}

void WallPotential::set_load(std::vector<double> pressure, std::vector<PetscInt> rims) {
  pressure_ = std::move(pressure);
  rims_ = std::move(rims);
}

double WallPotential::add_value_and_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const {
  gradient = -gradient;
  const double energy = elements_.add_force(x, thickness_ratio_, gradient);
  gradient = -gradient;
  return energy;
}

void WallPotential::update_hessian(const Field& x, double psd_blend) {
  at_rims_.clear();
  if (psd_blend == Curvature::psd) {
    positive_.update(x, thickness_ratio_, {});
    in_use_ = &positive_;
    return;
  }
  if (blends()) {
    blended_->leave_out(psd_blend);
  }
  std::vector<double> pressure = pressure_;
  for (double& p : pressure) {
    p *= 1 - psd_blend;
  }
  exact_->update(x, thickness_ratio_, pressure);
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

}  // namespace pellicle::prism
