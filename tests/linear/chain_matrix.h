#pragma once

#include <Eigen/Core>

#include "base/error.h"
#include "base/handle.h"

namespace pellicle {

/// 2 on the diagonal and `beside` next to it: -1 is positive definite, -2 indefinite.
inline MatHandle chain_matrix(PetscInt size, double beside = -1) {
  MatHandle matrix;
  PetscInt first = 0;
  PetscInt end = 0;
  check(
      MatCreateAIJ(PETSC_COMM_WORLD, PETSC_DECIDE, PETSC_DECIDE, size, size, 3, nullptr, 2, nullptr, matrix.create()));
  check(MatGetOwnershipRange(matrix, &first, &end));
  for (PetscInt i = first; i < end; ++i) {
    check(MatSetValue(matrix, i, i, 2, INSERT_VALUES));
    for (const PetscInt j : {i - 1, i + 1}) {
      if (j >= 0 && j < size) {
        check(MatSetValue(matrix, i, j, beside, INSERT_VALUES));
      }
    }
  }
  check(MatAssemblyBegin(matrix, MAT_FINAL_ASSEMBLY));
  check(MatAssemblyEnd(matrix, MAT_FINAL_ASSEMBLY));
  return matrix;
}

/// The same on every rank.
inline Eigen::MatrixXd dense_chain(Eigen::Index size, double beside = -1) {
  Eigen::MatrixXd matrix = 2 * Eigen::MatrixXd::Identity(size, size);
  matrix.diagonal(1).setConstant(beside);
  matrix.diagonal(-1).setConstant(beside);
  return matrix;
}

}  // namespace pellicle
