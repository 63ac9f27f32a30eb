#include "projection/joint_gram.h"

#include <algorithm>
#include <utility>

#include "base/error.h"
#include "linear/ksp.h"
#include "linear/shell_operations.h"
#include "parallel/collective.h"

namespace pellicle::projection {

JointGram::JointGram(const Sheet& sheet, std::vector<Colour> colours, const std::string& prefix, double rtol)
    : sheet_(sheet), colours_(std::move(colours)), sum_(sheet.particles, 3) {
  std::size_t unknowns = 0;
  for (const Colour colour : colours_) {
    offset_[colour] = unknowns;
    unknowns += static_cast<std::size_t>(sheet.of(colour).owned());
  }
  diagonal_.assign(unknowns, 1);
  shift_.assign(unknowns, 0);
  lambda_values_.assign(unknowns, 0);
  const auto count = static_cast<PetscInt>(unknowns);
  matrix_ = symmetric_shell<&JointGram::multiply>(sheet.comm(), count, this);
  set_shell_operation<&JointGram::copy_diagonal>(matrix_, MATOP_GET_DIAGONAL);
  set_definite(matrix_);
  set_matrix_options(matrix_, prefix);
  KspDefaults defaults{KSPCG, PCJACOBI, rtol, 10000};
  defaults.fields = {"lambda"};
  defaults.largest_rtol = largest_unjudged_rtol;
  ksp_ = make_ksp(matrix_, matrix_, prefix, defaults);
  check(KSPSetInitialGuessNonzero(ksp_, PETSC_TRUE));
  check(MatCreateVecs(matrix_, lambda_.create(), right_hand_side_.create()));
}

void JointGram::update(const std::array<const Eigen::Matrix3Xd*, 4>& gradient, const std::vector<double>& inverse_mass,
                       double shift, double shift_inverse_mass) {
  gradient_ = gradient;
  inverse_mass_ = &inverse_mass;
  double largest = 0;  // |gradient|^2
  for_each_unknown([&](std::size_t row, PetscInt a, PetscInt b, const double* g) {
    const double square = Eigen::Map<const Eigen::Vector3d>(g).squaredNorm();
    largest = std::max(largest, square);
    diagonal_[row] = (inverse_mass[a] + inverse_mass[b]) * square;
  });
  largest = max_over_ranks(sheet_.comm(), largest);
  const double scale = largest > 0 ? 2 * shift_inverse_mass * largest : 1;
  for (std::size_t k = 0; k < diagonal_.size(); ++k) {
    shift_[k] = diagonal_[k] > 0 ? shift * scale : scale;
    diagonal_[k] += shift_[k];
  }
  check(MatAssemblyBegin(matrix_, MAT_FINAL_ASSEMBLY));  // Tells PETSc that values have changed.
  check(MatAssemblyEnd(matrix_, MAT_FINAL_ASSEMBLY));
}

/// sum_ = J^T lambda, ghosts added to their owners.
void JointGram::add_transpose(const double* lambda) {
  sum_.values().setZero();
  double* sums = sum_.data();
  for_each_unknown([sums, lambda](std::size_t row, PetscInt a, PetscInt b, const double* g) {
    const double value = lambda[row];
    for (int k = 0; k < 3; ++k) {
      sums[3 * a + k] += value * g[k];
      sums[3 * b + k] -= value * g[k];
    }
  });
  sum_.add_ghosts();
}

void JointGram::multiply(Vec in_vector, Vec out_vector) {
  const ConstVecValues in(in_vector);
  VecValues out(out_vector);
  add_transpose(in.data());
  double* sums = sum_.data();
  for (PetscInt i = 0; i < sheet_.particles.owned; ++i) {
    sum_.vector(i) *= (*inverse_mass_)[i];
  }
  sum_.update_ghosts();
  for_each_unknown([&](std::size_t row, PetscInt a, PetscInt b, const double* g) {
    const double* at_a = sums + 3 * a;
    const double* at_b = sums + 3 * b;
    out[row] =
        shift_[row] * in[row] + g[0] * (at_a[0] - at_b[0]) + g[1] * (at_a[1] - at_b[1]) + g[2] * (at_a[2] - at_b[2]);
  });
  check(PetscLogFlops(20.0 * static_cast<double>(diagonal_.size())));
}

void JointGram::copy_diagonal(Vec out) const { copy_to(out, diagonal_); }

StageResult JointGram::solve(const std::vector<double>& right_hand_side, const LinearNeed& need) {
  copy_to(right_hand_side_, right_hand_side);
  const StageResult result = pellicle::solve(ksp_, right_hand_side_, lambda_, &need);
  std::copy_n(ConstVecValues(lambda_).data(), lambda_values_.size(), lambda_values_.begin());
  return result;
}

void JointGram::apply_transpose(Eigen::Matrix3Xd& result) {
  add_transpose(lambda_values_.data());
  result = sum_.values();
}

}  // namespace pellicle::projection
