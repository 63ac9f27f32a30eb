#pragma once

#include <petscmat.h>

#include "energies/hessian_terms.h"

namespace pellicle::energies {

/// Multiplies the terms of a Hessian with a vector.
///
/// Vectors have four numbers for each local vertex, one vector register: x, y, z, and one for products along normals.
class TermProduct : public HessianTerms {
 public:
  /// @param owned, local numbers of vertices @param factor (4 x local); its last row is overwritten
  /// @param product (4 x local), to which products are added; for ghosts these are only parts of the sum
  TermProduct(PetscInt owned, PetscInt local, double* factor, double* product)
      : HessianTerms(owned), local_(local), factor_(factor), product_(product) {}

  void add_block(PetscInt row, PetscInt column, const Eigen::Matrix3d& block) override;
  void add_differences(const std::vector<DifferenceTerm>& terms) override;
  void add_numbers(const NumberRows& rows) override;

 private:
  PetscInt local_;
  double* factor_;
  double* product_;
};

/// Gives a BAIJ matrix with blocks of 3 a product of its own where the processor has AVX2 and FMA; elsewhere PETSc's
/// stays in use. While the matrix fits in the caches it takes two thirds of the time. To be called after preallocation.
void use_fast_product(Mat matrix);

}  // namespace pellicle::energies
