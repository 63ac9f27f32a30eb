#include "prism/wall_potential.h"

#include <utility>

#include "prism/gradient_stiffness.h"

namespace pellicle {
inline namespace prism {

namespace {

std::unique_ptr<ElementStiffness> make_stiffness(const PrismElements& elements, const PrismOptions& options) {
  if (options.tangent == ElementTangent::exact) {
    return std::make_unique<MetricStiffness>(elements, options.positive_elements);
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
      exact_(make_stiffness(elements, options)),
      positive_(elements, true),
      in_use_(exact_.get()),
      thickness_ratio_(elements.membrane().triangles.size(), 1.0) {}

void WallPotential::set_load(std::vector<double> pressure, const Eigen::Vector3d& origin) {
  pressure_ = std::move(pressure);
  origin_ = origin;
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
    exact_->update(x, thickness_ratio_, {pressure_, origin_});
    in_use_ = exact_.get();
  }
}

}  // namespace prism
}  // namespace pellicle
