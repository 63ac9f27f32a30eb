#pragma once

#include <Eigen/Core>
#include <vector>

#include "energies/potential.h"
#include "geometry/projectors.h"

namespace pellicle {
inline namespace energies {

/// The sum of potentials at one position, whose value and gradient are evaluated once. No sums over ranks.
class PotentialSum {
 public:
  /// Discards the sum, when the position or a potential has changed.
  void forget() { is_evaluated_ = false; }
  /// Evaluates the potentials at x, unless that has been done. Collective.
  /// @param projectors on the directions in which the local vertices may move
  /// @param x positions of the vertices, ghosts up to date @param owned number of owned vertices
  void evaluate(const std::vector<Potential*>& potentials, const Projectors& projectors, const Field& x,
                PetscInt owned);

  /// This rank's fraction of the sum [J].
  double value() const { return value_; }
  /// Derivative by the owned vertices, in the directions in which they may move (3 x owned) [N].
  const Eigen::Matrix3Xd& gradient() const { return gradient_; }
  /// This rank's square of the norm of each potential's gradient [N^2].
  const std::vector<double>& squares() const { return squares_; }

 private:
  bool is_evaluated_ = false;
  double value_ = 0;
  Eigen::Matrix3Xd gradient_;
  Eigen::Matrix3Xd of_potential_;  ///< the gradient of one potential, kept so that a step allocates nothing
  std::vector<double> squares_;
};

}  // namespace energies
}  // namespace pellicle
