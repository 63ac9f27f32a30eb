#include "energies/block_product.h"

#include "base/error.h"
#include "linear/shell_operations.h"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace pellicle {
inline namespace energies {

#if defined(__x86_64__)

namespace {

/// y = A x, row by row; blocks are stored by columns. @param rows number of rows of blocks
[[gnu::target("avx2,fma")]] void multiply(PetscInt rows, const PetscInt* offsets, const PetscInt* columns,
                                          const double* blocks, const double* x, double* y) {
  const __m256i three = _mm256_set_epi64x(0, -1, -1, -1);
  const PetscInt last = offsets[rows] - 1;  // Its last column cannot be read in fours: nothing follows.
  for (PetscInt i = 0; i < rows; ++i) {
    __m256d sum0 = _mm256_setzero_pd();  // one for each column of the blocks, so that none waits for another
    __m256d sum1 = sum0;
    __m256d sum2 = sum0;
    for (PetscInt k = offsets[i]; k < offsets[i + 1]; ++k) {
      const double* block = blocks + 9 * k;
      const double* w = x + 3 * columns[k];
      const __m256d column2 = k < last ? _mm256_loadu_pd(block + 6) : _mm256_maskload_pd(block + 6, three);
      sum0 = _mm256_fmadd_pd(_mm256_loadu_pd(block), _mm256_broadcast_sd(w), sum0);
      sum1 = _mm256_fmadd_pd(_mm256_loadu_pd(block + 3), _mm256_broadcast_sd(w + 1), sum1);
      sum2 = _mm256_fmadd_pd(column2, _mm256_broadcast_sd(w + 2), sum2);
    }
    _mm256_maskstore_pd(y + 3 * i, three, _mm256_add_pd(sum0, _mm256_add_pd(sum1, sum2)));
  }
}

PetscErrorCode multiply_sequential(Mat matrix, Vec in, Vec out) {
  return as_petsc_callback([&] {
    PetscInt rows = 0;
    const PetscInt* offsets = nullptr;
    const PetscInt* columns = nullptr;
    PetscBool done = PETSC_FALSE;
    double* blocks = nullptr;
    check(MatGetRowIJ(matrix, 0, PETSC_FALSE, PETSC_TRUE, &rows, &offsets, &columns, &done));
    check(MatSeqBAIJGetArray(matrix, &blocks));
    multiply(rows, offsets, columns, blocks, ConstVecValues(in).data(), VecValues(out).data());
    check(PetscLogFlops(18.0 * static_cast<double>(offsets[rows])));
    check(MatSeqBAIJRestoreArray(matrix, &blocks));
    check(MatRestoreRowIJ(matrix, 0, PETSC_FALSE, PETSC_TRUE, &rows, &offsets, &columns, &done));
  });
}

}  // namespace

#endif

void use_fast_product([[maybe_unused]] Mat matrix) {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
    PetscBool several_ranks = PETSC_FALSE;
    check(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(matrix), MATMPIBAIJ, &several_ranks));
    if (several_ranks == PETSC_TRUE) {  // The part of a rank's own columns; that of others' is small.
      check(MatMPIBAIJGetSeqBAIJ(matrix, &matrix, nullptr, nullptr));
    }
    PetscErrorCode (*product)(Mat, Vec, Vec) = multiply_sequential;
    check(MatSetOperation(matrix, MATOP_MULT, reinterpret_cast<void (*)()>(product)));
  }
#endif
}

}  // namespace energies
}  // namespace pellicle
