#pragma once

#include <Eigen/Core>
#include <vector>

#include "linear/low_rank_system.h"

namespace pellicle::linear {

/// A system with a border: rows and columns beside those of a LowRankSystem, its part. A vector of the bordered system
/// has the rows of the part's T, and after rank 0's rows those of the border.
class Border {
 public:
  /// Collective. @param part must outlive the border @param size number of the border's rows
  Border(LowRankSystem& part, int size);
  virtual ~Border() = default;
  Border(const Border&) = delete;  // The matrix points to this object.
  Border& operator=(const Border&) = delete;

  /// The system's matrix, as a product with vectors.
  Mat matrix() const { return matrix_; }

  /// Rows of the border on this rank: all of them on rank 0.
  PetscInt border_rows() const { return rank_of(comm_of(part_.sparse())) == 0 ? size_ : 0; }

  /// The border's entries of a vector, on every rank. Collective.
  Eigen::VectorXd border_values(Vec vector) const;

 protected:
  virtual void multiply(Vec x, Vec y) = 0;
  /// Multiplies the part's rows of x by T into `part_solution_`. @returns their products with the part's columns
  Eigen::VectorXd multiply_part(Vec x);
  /// Sets a vector of the bordered system to the part's solution and values of the border.
  void join(Vec vector, const Eigen::VectorXd& border) const;
  Eigen::Index rows() const { return part_.rows(); }

  LowRankSystem& part_;
  const int size_;  ///< number of the border's rows
  VecHandle part_right_hand_side_;
  VecHandle part_solution_;

 private:
  MatHandle matrix_;
};

/// The system [T', -G S; -S G^T, 0] [x; z] = [r; q]: columns G of a LowRankSystem border it, with scales S; T' is its T
/// plus the terms of the other columns. x = x0 + y, where x0, a sum of columns, has S G^T x0 = -q, and y is orthogonal
/// to the columns. Iterations solve for y alone, in a space where T' is positive definite if prescribed volumes make
/// the state stable (Gould, Hribar and Nocedal, On the solution of equality constrained quadratic programming problems,
/// SIAM J. Sci. Comput. 23, 2001).
///
/// A solver that works with T alone eliminates blocks instead. T' is then replaced by the system's own A, with rho g
/// g^T of the bordering columns, and r is changed accordingly: for S G^T x = -q the solution is the same, and A stays
/// positive definite even where T' is so only on the x with G^T x = 0. A column's rho is its coefficient there.
class BorderedSystem : public Border {
 public:
  /// Collective. @param part must outlive the system @param columns bordering columns of `part`, at least one
  BorderedSystem(LowRankSystem& part, std::vector<int> columns, Eigen::VectorXd scales);

  /// Solves; rejects a solution along which the matrix has negative curvature, as conjugate gradients do. Collective.
  LinearResult solve(Vec right_hand_side, Vec solution);

 private:
  LinearResult solve_orthogonally(const Eigen::VectorXd& wanted);
  LinearResult eliminate(const Eigen::VectorXd& wanted);
  void multiply(Vec x, Vec y) override;

  std::vector<int> columns_;
  Eigen::VectorXd scales_;
  VecHandle work_;
  Eigen::VectorXd scaled_border_;     ///< S z, of the last solve
  std::vector<VecHandle> influence_;  ///< A^-1 g of the bordering columns, where blocks are eliminated
};

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
  void update(const Eigen::VectorXd& load, double scale) {
    load_ = load;
    scale_ = scale;
  }

  /// Solves; there is no solution if g^T A^-1 l is 0. Collective.
  LinearResult solve(Vec right_hand_side, Vec solution);

 private:
  void multiply(Vec x, Vec y) override;
  int last() const { return part_.count() - 1; }

  Eigen::VectorXd load_;  ///< l
  double scale_ = 1;      ///< S
  VecHandle influence_;   ///< A^-1 l
};

}  // namespace pellicle::linear
