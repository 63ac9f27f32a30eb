#include "projection/gram.h"

#include <algorithm>
#include <array>

#include "base/error.h"
#include "base/sorting.h"
#include "linear/ksp.h"
#include "linear/shell_operations.h"
#include "parallel/collective.h"

namespace pellicle::projection {

void linearise(const SpringSet& springs, const double* x, const std::vector<double>& target,
               const std::vector<bool>& active, Linearisation& result) {
  using Place = Eigen::Map<const Eigen::Vector3d>;
  const PetscInt count = springs.local();
  result.error.resize(count);
  result.gradient.resize(3, count);
  for (PetscInt s = 0; s < count; ++s) {
    if (!active[s]) {
      result.error[s] = 0;
      result.gradient.col(s).setZero();
      continue;
    }
    const auto& [a, b] = springs.ends[s];
    const Eigen::Vector3d d = Place(x + 3 * a) - Place(x + 3 * b);
    const double l = target[s];
    result.error[s] = d.squaredNorm() / l - l;
    result.gradient.col(s) = (2 / l) * d;
  }
  check(PetscLogFlops(14.0 * static_cast<double>(count)));
}

Gram::Gram(const SpringSet& springs, const Layout& particles, Choice<GramFormat> mat_type, const std::string& prefix)
    : springs_(springs), particles_(particles), mat_type_(mat_type), lambda_(springs.layout, 1) {
  const PetscInt owned = springs_.owned();
  diagonal_.resize(owned);
  const auto update_lines = [this] {
    if (lines_ == nullptr) {
      lines_ = std::make_unique<LineElimination>(springs_, particles_);
      preconditioner_.words = lines_->words();
    }
    lines_->update(diagonal_, *gradient_, *inverse_mass_);
  };
  preconditioner_ = {update_lines, [this](Vec in, Vec out) { lines_->apply(in, out); },
                     "tridiagonal solves along lines of springs"};
  if (mat_type_ == GramFormat::shell) {
    other_ = symmetric_shell<&Gram::multiply>(springs_.layout.comm, owned, this);
    set_shell_operation<&Gram::copy_diagonal>(other_, MATOP_GET_DIAGONAL);
  } else {
    const auto rows = numbers_up_to<PetscInt>(owned);
    std::vector<PetscInt> columns;
    for (PetscInt s = 0; s < springs_.local(); ++s) {
      columns.push_back(springs_.layout.to_global(s));
    }
    rows_ = std::make_unique<GramBlock>(springs_, particles_, rows, columns, owned);
  }
  set_definite(preconditioning_matrix());
  set_matrix_options(preconditioning_matrix(), prefix);
  offer_preconditioner(preconditioning_matrix(), LineElimination::type, preconditioner_);
  if (mat_type_ == GramFormat::sell) {
    check(MatConvert(rows_->matrix(), MATSELL, MAT_INITIAL_MATRIX, other_.create()));
    set_definite(other_);
  }
}

void Gram::update(const Eigen::Matrix3Xd& gradient, const std::vector<double>& inverse_mass, double shift,
                  std::optional<double> shift_inverse_mass) {
  gradient_ = &gradient;
  inverse_mass_ = &inverse_mass;
  double largest_entry = 0;
  double largest_square = 0;  // of gradients
  for (PetscInt s = 0; s < springs_.owned(); ++s) {
    const auto& [a, b] = springs_.ends[s];
    const double square = gradient.col(s).squaredNorm();
    const double entry = (inverse_mass[a] + inverse_mass[b]) * square;
    diagonal_[s] = entry;
    largest_entry = std::max(largest_entry, entry);
    largest_square = std::max(largest_square, square);
  }
  const auto [entries, squares] = max_over_ranks(springs_.layout.comm, std::array{largest_entry, largest_square});
  const double largest = entries > 0 ? entries : 1;
  const double shifted_by = shift * (shift_inverse_mass ? 2 * *shift_inverse_mass * squares : largest);
  constexpr double negligible = 1e-14;
  for (double& entry : diagonal_) {
    entry += entry > negligible * largest ? shifted_by : largest;
  }
  if (mat_type_ == GramFormat::shell) {
    check(MatAssemblyBegin(other_, MAT_FINAL_ASSEMBLY));  // Tells the preconditioner that values have changed.
    check(MatAssemblyEnd(other_, MAT_FINAL_ASSEMBLY));
    return;
  }
  rows_->update(gradient, inverse_mass, diagonal_);
  if (mat_type_ == GramFormat::sell) {
    Mat sell = other_;
    check(MatConvert(rows_->matrix(), MATSELL, MAT_REUSE_MATRIX, &sell));
  }
}

void Gram::apply_transpose(const Eigen::Matrix3Xd& gradient, Vec lambda, Eigen::Matrix3Xd& result) {
  std::copy_n(ConstVecValues(lambda).data(), springs_.owned(), lambda_.data());
  lambda_.update_ghosts();
  result.setZero(3, particles_.local());
  for (PetscInt s = 0; s < springs_.local(); ++s) {
    const auto& [a, b] = springs_.ends[s];
    const Eigen::Vector3d force = lambda_.data()[s] * gradient.col(s);
    result.col(a) += force;
    result.col(b) -= force;
  }
  check(PetscLogFlops(9.0 * static_cast<double>(springs_.ends.size())));
}

void Gram::copy_diagonal(Vec out) const { copy_to(out, diagonal_); }

void Gram::multiply(Vec in, Vec out) {
  apply_transpose(*gradient_, in, particle_sum_);
  const double* lambda = lambda_.data();
  VecValues values(out);
  for (PetscInt s = 0; s < springs_.owned(); ++s) {
    const auto& [a, b] = springs_.ends[s];
    const double mass_a = (*inverse_mass_)[a];
    const double mass_b = (*inverse_mass_)[b];
    const auto own = gradient_->col(s);
    // The sums include the spring's own share; the diagonal replaces it with the shifted one.
    const double without_shift = (mass_a + mass_b) * own.squaredNorm();
    values[s] = own.dot(mass_a * particle_sum_.col(a) - mass_b * particle_sum_.col(b)) +
                (diagonal_[s] - without_shift) * lambda[s];
  }
  check(PetscLogFlops(27.0 * static_cast<double>(diagonal_.size())));
}

}  // namespace pellicle::projection
