#include "geometry/principal_axes.h"

#include <Eigen/Eigenvalues>

namespace pellicle::geometry {

PrincipalAxes principal_axes(const Eigen::MatrixXd& symmetric) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(symmetric);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

}  // namespace pellicle::geometry
