#include "prism/damping_potential.h"

#include "prism/wall_potential.h"

namespace pellicle::prism {

DampingPotential::DampingPotential(const PrismElements& elements, const std::vector<double>& mass,
                                   const PrismOptions& options)
    : membrane_(elements.membrane()),
      mass_(mass),
      mass_damping_(options.mass_damping),
      stiffness_damping_(options.stiffness_damping),
      stiffness_(elements, true) {}

void DampingPotential::begin_step(const Field& at, const std::vector<double>& thickness_ratio,
                                  const Eigen::Matrix3Xd& still, double rate) {
  y_v_ = still;
  rate_ = rate;
  if (multiplies()) {
    stiffness_.update(at, thickness_ratio, {});
  }
}

Eigen::Matrix3Xd DampingPotential::force(const Field& x) const {
  const Eigen::Matrix3Xd displacement = x.values() - y_v_;
  Eigen::Matrix3Xd result = Eigen::Matrix3Xd::Zero(3, displacement.cols());
  add_product(displacement.data(), result.data());
  return result.leftCols(membrane_.particles.owned);
}

double DampingPotential::value(const Field& x) const {
  return force(x).cwiseProduct((x.values() - y_v_).leftCols(membrane_.particles.owned)).sum() / 2;
}

void DampingPotential::add_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const { gradient += force(x); }

std::vector<VertexPair> DampingPotential::pattern() const {
  std::vector<VertexPair> pairs;
  if (multiplies()) {
    pairs = pairs_of_elements(membrane_);
  }
  for (PetscInt i = 0; i < membrane_.particles.owned; ++i) {
    pairs.push_back({i, membrane_.particles.to_global(i)});
  }
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
