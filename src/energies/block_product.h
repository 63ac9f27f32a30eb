#pragma once

#include <petscmat.h>

namespace pellicle {
inline namespace energies {

/// Gives a BAIJ matrix with blocks of 3 a product of its own where the processor has AVX2 and FMA; elsewhere PETSc's
/// stays in use. While the matrix fits in the caches it takes two thirds of the time. To be called after preallocation.
void use_fast_product(Mat matrix);

}  // namespace energies
}  // namespace pellicle
