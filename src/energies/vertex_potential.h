#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "energies/potential.h"
#include "parallel/layout.h"

namespace pellicle::energies {

/// Potential energy of one vertex, with derivatives by its position.
struct PointPotential {
  double value = 0;                                    ///< [J]
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();  ///< minus the force [N]
  Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();   ///< positive semi-definite [N/m]
};

/// Potential sum_i f(i, x_i) over single vertices, without communication.
/// @tparam Function called with an owned vertex and its position [m], returns a PointPotential
template <class Function>
class VertexPotential : public Potential {
 public:
  /// The layout must outlive it.
  VertexPotential(const Layout& vertices, Function function) : vertices_(vertices), function_(std::move(function)) {}

  double value(const Field& x) const override {
    double sum = 0;
    for (PetscInt i = 0; i < vertices_.owned; ++i) {
      sum += function_(i, x.vector(i)).value;
    }
    return sum;
  }

  void add_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const override { add_value_and_gradient(x, gradient); }

  double add_value_and_gradient(const Field& x, Eigen::Matrix3Xd& gradient) const override {
    double sum = 0;
    for (PetscInt i = 0; i < vertices_.owned; ++i) {
      const PointPotential point = function_(i, x.vector(i));
      gradient.col(i) += point.gradient;
      sum += point.value;
    }
    return sum;
  }

  std::vector<VertexPair> pattern() const override { return diagonal_pairs(vertices_); }

  void update_hessian(const Field& x, double /*psd_blend*/) override {
    hessian_.resize(vertices_.owned);
    for (PetscInt i = 0; i < vertices_.owned; ++i) {
      hessian_[i] = function_(i, x.vector(i)).hessian;
    }
  }

  void add_hessian(const HessianBlocks& blocks) const override {
    for (std::size_t i = 0; i < hessian_.size(); ++i) {
      blocks.add(i, hessian_[i]);
    }
  }

 private:
  const Layout& vertices_;
  Function function_;
  std::vector<Eigen::Matrix3d> hessian_;  ///< of the owned vertices, positive semi-definite [N/m]
};

template <class Function>
std::unique_ptr<Potential> make_vertex_potential(const Layout& vertices, Function function) {
  return std::make_unique<VertexPotential<Function>>(vertices, std::move(function));
}

}  // namespace pellicle::energies
