#include "base/error.h"
#include "base/handle.h"
#include "energies/tangent.h"
#include "linear/shell_operations.h"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace pellicle::energies {

namespace {

using Vector = Eigen::Map<Eigen::Vector3d>;
using ConstVector = Eigen::Map<const Eigen::Vector3d>;
using Vector4 = Eigen::Map<Eigen::Vector4d>;
using ConstVector4 = Eigen::Map<const Eigen::Vector4d>;

void multiply_differences(const std::vector<DifferenceTerm>& terms, const double* w, double* y) {
  for (const DifferenceTerm& term : terms) {
    const Eigen::Vector3d difference = ConstVector(w + 4 * term.a) - ConstVector(w + 4 * term.b);
    const Eigen::Vector3d force = term.direction.dot(difference) * term.direction + term.across * difference;
    Vector(y + 4 * term.a) += force;
    Vector(y + 4 * term.b) -= force;
  }
}

/// Product of rows of numbers with all four components.
void multiply_numbers(const NumberRows& rows, const double* w, double* y) {
  for (std::size_t i = 0; i + 1 < rows.offsets.size(); ++i) {
    const Eigen::Vector4d own = ConstVector4(w + 4 * i);
    Eigen::Vector4d sum = Eigen::Vector4d::Zero();
    const std::size_t end = rows.offsets[i + 1];
    for (std::size_t k = rows.offsets[i]; k < end; ++k) {
      const std::size_t j = rows.columns[k];
      sum += rows.entries[k] * ConstVector4(w + 4 * j);
      if (j != i) {
        Vector4(y + 4 * j) += rows.entries[k] * own;
      }
    }
    Vector4(y + 4 * i) += sum;
  }
}

#if defined(__x86_64__)

/// Product of difference terms; sums up the force on vertex a over consecutive terms with the same a.
[[gnu::target("avx2,fma")]] void multiply_differences_fast(const std::vector<DifferenceTerm>& terms, const double* w,
                                                           double* y) {
  const __m256i three = _mm256_set_epi64x(0, -1, -1, -1);
  for (std::size_t s = 0; s < terms.size();) {
    const PetscInt a = terms[s].a;
    const __m256d own = _mm256_loadu_pd(w + 4 * a);
    __m256d sum = _mm256_setzero_pd();
    for (; s < terms.size() && terms[s].a == a; ++s) {
      const DifferenceTerm& term = terms[s];
      const __m256d difference = _mm256_sub_pd(own, _mm256_loadu_pd(w + 4 * term.b));
      const __m256d direction = _mm256_maskload_pd(term.direction.data(), three);
      const __m256d products = _mm256_mul_pd(direction, difference);
      const __m256d pairs = _mm256_add_pd(products, _mm256_permute_pd(products, 0b0101));
      const __m256d dot = _mm256_add_pd(pairs, _mm256_permute4x64_pd(pairs, 0b01001110));
      const __m256d force =
          _mm256_fmadd_pd(dot, direction, _mm256_mul_pd(_mm256_broadcast_sd(&term.across), difference));
      sum = _mm256_add_pd(sum, force);
      double* at_b = y + 4 * term.b;
      _mm256_storeu_pd(at_b, _mm256_sub_pd(_mm256_loadu_pd(at_b), force));
    }
    _mm256_storeu_pd(y + 4 * a, _mm256_add_pd(_mm256_loadu_pd(y + 4 * a), sum));
  }
}

[[gnu::target("avx2,fma")]] void multiply_numbers_fast(const NumberRows& rows, const double* w, double* y) {
  const auto owned = static_cast<PetscInt>(rows.offsets.size()) - 1;
  for (PetscInt i = 0; i < owned; ++i) {
    const __m256d own = _mm256_loadu_pd(w + 4 * i);
    __m256d sum = _mm256_setzero_pd();
    std::size_t k = rows.offsets[i];
    const std::size_t end = rows.offsets[static_cast<std::size_t>(i) + 1];
    if (k < end && rows.columns[k] == i) {
      sum = _mm256_mul_pd(_mm256_broadcast_sd(&rows.entries[k]), own);
      ++k;
    }
    for (; k < end; ++k) {
      const PetscInt j = rows.columns[k];
      const __m256d entry = _mm256_broadcast_sd(&rows.entries[k]);
      sum = _mm256_fmadd_pd(entry, _mm256_loadu_pd(w + 4 * j), sum);
      _mm256_storeu_pd(y + 4 * j, _mm256_fmadd_pd(entry, own, _mm256_loadu_pd(y + 4 * j)));
    }
    _mm256_storeu_pd(y + 4 * i, _mm256_add_pd(_mm256_loadu_pd(y + 4 * i), sum));
  }
}

/// y = A x, row by row; blocks are stored by columns. @param rows number of rows of blocks
[[gnu::target("avx2,fma")]] void multiply_blocks(PetscInt rows, const PetscInt* offsets, const PetscInt* columns,
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
    multiply_blocks(rows, offsets, columns, blocks, ConstVecValues(in).data(), VecValues(out).data());
    check(PetscLogFlops(18.0 * static_cast<double>(offsets[rows])));
    check(MatSeqBAIJRestoreArray(matrix, &blocks));
    check(MatRestoreRowIJ(matrix, 0, PETSC_FALSE, PETSC_TRUE, &rows, &offsets, &columns, &done));
  });
}

bool has_fast() { return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"); }

#else

constexpr auto multiply_differences_fast = multiply_differences;
constexpr auto multiply_numbers_fast = multiply_numbers;
constexpr bool has_fast() { return false; }

#endif

}  // namespace

void TermProduct::add_block(PetscInt row, PetscInt column, const Eigen::Matrix3d& block) {
  Vector(product_ + 4 * row) += block * ConstVector(factor_ + 4 * column);
}

void TermProduct::add_differences(const std::vector<DifferenceTerm>& terms) {
  static const auto multiply = has_fast() ? multiply_differences_fast : multiply_differences;
  multiply(terms, factor_, product_);
  check(PetscLogFlops(23.0 * static_cast<double>(terms.size())));
}

/// The fourth row holds the components along normals, which the same numbers multiply.
void TermProduct::add_numbers(const NumberRows& rows) {
  static const auto multiply = has_fast() ? multiply_numbers_fast : multiply_numbers;
  const bool has_normals = rows.along != 0;
  for (PetscInt i = 0; has_normals && i < local_; ++i) {
    factor_[4 * i + 3] = rows.normals.vector(i).dot(ConstVector(factor_ + 4 * i));
    product_[4 * i + 3] = 0;
  }
  multiply(rows, factor_, product_);
  for (PetscInt i = 0; has_normals && i < owned_; ++i) {
    Vector(product_ + 4 * i) += rows.along * product_[4 * i + 3] * rows.normals.vector(i);
  }
  check(PetscLogFlops(16.0 * static_cast<double>(rows.entries.size())));
}

void use_fast_product([[maybe_unused]] Mat matrix) {
#if defined(__x86_64__)
  if (has_fast()) {
    if (has_type(matrix, {MATMPIBAIJ})) {  // The part of a rank's own columns; that of others' is small.
      check(MatMPIBAIJGetSeqBAIJ(matrix, &matrix, nullptr, nullptr));
    }
    PetscErrorCode (*product)(Mat, Vec, Vec) = multiply_sequential;
    check(MatSetOperation(matrix, MATOP_MULT, reinterpret_cast<void (*)()>(product)));
  }
#endif
}

}  // namespace pellicle::energies
