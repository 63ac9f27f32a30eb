#pragma once

#include "solvers/hessian_terms.h"

namespace pellicle {
inline namespace solvers {

/// Multiplies a vector with the terms that it takes.
///
/// Vectors of the local vertices are rows of four numbers, which processors read at once: x, y, z, and one in which
/// products along normals are summed up.
class TermProduct : public HessianTerms {
 public:
  /// @param owned, local numbers of vertices @param factor (4 x local), whose last row is overwritten
  /// @param product (4 x local), to which products are added; for vertices that are not owned they are only parts of
  /// the sum
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

}  // namespace solvers
}  // namespace pellicle
