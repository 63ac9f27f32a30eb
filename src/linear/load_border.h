#pragma once

#include <Eigen/Core>

#include "linear/bordered_system.h"

namespace pellicle {
inline namespace linear {

/// The system [T', l; S g^T, 0] [x; z] = [r; q]: one more unknown is the load z, by which the residual changes as l,
/// and one more row prescribes the way along g. It follows equilibria past a limit point, where T' is singular (Riks,
/// An incremental approach to the solution of snapping and buckling problems, Int. J. Solids Struct. 15, 1979). g is
/// the last column of a LowRankSystem, T' its T plus the terms of the other columns. Solved by block elimination. T' is
/// replaced by the system's own A, with rho g g^T of that column, and r is changed accordingly: the solution is the
/// same, and A stays positive definite even where T' is so only on the x with g^T x = 0. rho is the column's
/// coefficient.
class LoadBorder : public Border {
 public:
  /// Collective. @param part must outlive the border
  explicit LoadBorder(LowRankSystem& part);

  /// Sets l and S. @param load l of the owned rows @param scale S
  void update(const Eigen::VectorXd& load, double scale);

  /// Solves; there is no solution if g^T A^-1 l is 0. Collective.
  LinearResult solve(Vec right_hand_side, Vec solution);

 private:
  void multiply(Vec x, Vec y) override;
  int last() const { return part_.count() - 1; }

  Eigen::VectorXd load_;  ///< l
  double scale_ = 1;      ///< S
  VecHandle influence_;   ///< A^-1 l
};

}  // namespace linear
}  // namespace pellicle
