#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <vector>

#include "base/namespaces.h"

namespace pellicle::linear {

/// Low-rank matrix G C G^T with G = S Q: the second derivative of a function of a few numbers, such as volumes. S is
/// sparse, as each number depends on some of the unknowns only; Q mixes its columns so that C is diagonal.
struct LowRank {
  /// A matrix without columns, 0.
  LowRank() = default;
  /// G = S.
  LowRank(Eigen::SparseMatrix<double> columns, Eigen::VectorXd coefficients)
      : sparse(std::move(columns)),
        mixing(Eigen::MatrixXd::Identity(sparse.cols(), sparse.cols())),
        coefficients(std::move(coefficients)) {}

  Eigen::Index count() const { return coefficients.size(); }
  /// A column of G.
  Eigen::VectorXd column(Eigen::Index number) const { return sparse * mixing.col(number); }
  /// Several columns of G, side by side.
  Eigen::MatrixXd columns(const std::vector<int>& numbers) const { return sparse * mixing(Eigen::all, numbers); }
  /// G w.
  Eigen::VectorXd times(const Eigen::VectorXd& weights) const { return sparse * (mixing * weights); }
  /// G^T x, of the rows of this rank.
  template <class Values>
  Eigen::VectorXd transposed_times(const Values& x) const {
    return mixing.transpose() * (sparse.transpose() * x);
  }

  Eigen::SparseMatrix<double> sparse;  ///< S, (owned rows x count)
  Eigen::MatrixXd mixing;              ///< Q, orthogonal, the same on every rank
  Eigen::VectorXd coefficients;        ///< the diagonal of C, the same on every rank
};

}  // namespace pellicle::linear
