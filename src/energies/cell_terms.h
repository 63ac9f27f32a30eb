#pragma once

#include <petscsys.h>

#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "base/namespaces.h"

namespace pellicle::energies {

/// Terms of a Hessian: eight cells, side by side in vectors of the processor. The energy of a cell is a function U of
/// the squared lengths q of the six edges between four local vertices, its sides and its diagonals, and
/// tie |x_c - mean|^2 / 2 with a fifth vertex c and the mean of the four. With the edges d the second derivative of U
/// is the sum of 4 d2U/(dq_e dq_f) d_e d_f^T and of 2 dU/dq_e in all directions. Cells that are not used are 0.
struct alignas(64) CellTerms {
  static constexpr std::size_t lanes = 8;
  static constexpr std::size_t edges = 6;
  static constexpr std::size_t points = 4;
  using Lanes [[gnu::vector_size(lanes * sizeof(double))]] = double;
  /// The points at which the edges begin and end.
  static constexpr std::array<std::array<std::size_t, 2>, edges> ends{{{0, 1}, {1, 2}, {2, 3}, {3, 0}, {0, 2}, {1, 3}}};

  Lanes arm[3][3];                          ///< from vertex 0 to 1, 2, 3 [m]; every edge is their difference
  Lanes coupling[edges * (edges + 1) / 2];  ///< 4 d2U/dq2, its upper half by rows [N/m^3]
  Lanes spread[edges];                      ///< 2 dU/dq [N/m]
  PetscInt vertex[points][lanes];

  /// The edges of a cell as columns [m].
  Eigen::Matrix<double, 3, edges> edges_of(std::size_t lane) const;
  /// 4 d2U/dq2 of a cell.
  Eigen::Matrix<double, edges, edges> coupling_of(std::size_t lane) const;
  /// The numbers by which `spread` couples the vertices of a cell alike in all directions [N/m].
  Eigen::Matrix<double, points, points> across_of(std::size_t lane) const;
};

/// The blocks of a cell's points with each other; those before the diagonal are not set.
using CellBlocks = std::array<std::array<Eigen::Matrix3d, CellTerms::points>, CellTerms::points>;
/// @param wants_off_diagonal if not, only the blocks of points with themselves are set
void set_blocks(CellBlocks& blocks, const CellTerms& cells, std::size_t lane, bool wants_off_diagonal);

/// Adds the product of some terms with w to `result`, both four numbers for each local vertex; the fourth stays.
void multiply_cells(const CellTerms* cells, std::size_t count, const double* w, double* result);

}  // namespace pellicle::energies
