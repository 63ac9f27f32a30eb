#pragma once

#include <Eigen/Core>

#include "base/namespaces.h"

namespace pellicle::geometry {

/// Eigenvalues, ascending, and orthonormal eigenvectors of a symmetric matrix.
struct PrincipalAxes {
  Eigen::VectorXd values;
  Eigen::MatrixXd axes;  ///< eigenvectors as columns
};

/// Principal axes of a matrix of any size. Compiled once, since Eigen's blocked algorithms take long to compile.
PrincipalAxes principal_axes(const Eigen::MatrixXd& symmetric);

}  // namespace pellicle::geometry
