#include "prism/wall_potential.h"

#include <utility>

#include "prism/gradient_stiffness.h"

namespace pellicle {
inline namespace prism {

namespace {

/// @param blended the same, if it is exact and knows its positive part
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

std::vector<VertexPair> pairs_of_elements(const Membrane& membrane) {
  std::vector<VertexPair> pairs;
  pairs.reserve(9 * membrane.triangles.size());
  for (const std::array<PetscInt, 3>& triangle : membrane.triangles) {
    for (const PetscInt i : triangle) {
      for (const PetscInt j : triangle) {
        pairs.push_back({i, membrane.particles.to_global(j)});
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

void WallPotential::set_load(std::vector<double> pressure, const Eigen::Vector3d& origin) {
  pressure_ = std::move(pressure);
  origin_ = origin;
}

void WallPotential::set_positive_share(double share) {
  positive_share_ = share;
  if (blends()) {
    blended_->leave_out(share);
  }
}

void WallPotential::add_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const {
  Eigen::Matrix3Xd force = Eigen::Matrix3Xd::Zero(3, gradient.cols());
  elements_.add_force(x, thickness_ratio_, force);
  gradient -= force;
}

void WallPotential::update_hessian(const Field& x, Curvature curvature) {
  if (curvature == Curvature::positive) {
    positive_.update(x, thickness_ratio_, {{}, origin_});
    in_use_ = &positive_;
  } else {
    std::vector<double> pressure = pressure_;
    for (double& p : pressure) {
      p *= 1 - positive_share_;
    }
    exact_->update(x, thickness_ratio_, {pressure, origin_});
    in_use_ = exact_.get();
  }
}

}  // namespace prism
}  // namespace pellicle
