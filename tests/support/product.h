#pragma once

#include "energies/tangent.h"

namespace pellicle {

/// Product of a potential's Hessian, which it gives by terms, with vectors of the local vertices. @returns those of the
/// owned ones
inline Eigen::Matrix3Xd product_of(const Potential& potential, PetscInt owned, const Eigen::Matrix3Xd& vectors) {
  Eigen::Matrix4Xd factor = Eigen::Matrix4Xd::Zero(4, vectors.cols());
  Eigen::Matrix4Xd product = factor;
  factor.topRows<3>() = vectors;
  TermProduct terms(owned, static_cast<PetscInt>(vectors.cols()), factor.data(), product.data());
  potential.visit(terms);
  return product.topLeftCorner(3, owned);
}

}  // namespace pellicle
