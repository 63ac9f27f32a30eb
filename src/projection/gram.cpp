#include "projection/gram.h"

#include <algorithm>

#include "base/error.h"

namespace pellicle {

namespace {

using ConstVector = Eigen::Map<const Eigen::Vector3d>;

/// Springs at each local particle in compressed rows.
struct Incidence {
  std::vector<PetscInt> offsets;
  std::vector<PetscInt> springs;
};

Incidence incidence(const SpringSet& set, PetscInt particles) {
  Incidence result;
  result.offsets.assign(static_cast<std::size_t>(particles) + 1, 0);
  for (const auto& ends : set.ends) {
    for (const PetscInt end : ends) {
      ++result.offsets[static_cast<std::size_t>(end) + 1];
    }
  }
  for (std::size_t i = 1; i < result.offsets.size(); ++i) {
    result.offsets[i] += result.offsets[i - 1];
  }
  result.springs.resize(2 * set.ends.size());
  std::vector<PetscInt> next(result.offsets.begin(), result.offsets.end() - 1);
  for (std::size_t s = 0; s < set.ends.size(); ++s) {
    for (const PetscInt end : set.ends[s]) {
      result.springs[static_cast<std::size_t>(next[static_cast<std::size_t>(end)]++)] = static_cast<PetscInt>(s);
    }
  }
  return result;
}

}  // namespace

void linearise(const SpringSet& springs, const double* x, const std::vector<double>& target, Linearisation& result) {
  const std::size_t count = springs.ends.size();
  result.error.resize(static_cast<Eigen::Index>(count));
  result.gradient.resize(3, static_cast<Eigen::Index>(count));
  for (std::size_t s = 0; s < count; ++s) {
    const auto& [a, b] = springs.ends[s];
    const Eigen::Vector3d d = ConstVector(x + 3 * a) - ConstVector(x + 3 * b);
    const double l = target[s];
    result.error[static_cast<Eigen::Index>(s)] = d.squaredNorm() / l - l;
    result.gradient.col(static_cast<Eigen::Index>(s)) = (2 / l) * d;
  }
}

double squared_error(const SpringSet& springs, const double* x, const std::vector<double>& target) {
  double sum = 0;
  for (std::size_t s = 0; s < static_cast<std::size_t>(springs.owned()); ++s) {
    const auto& [a, b] = springs.ends[s];
    const double error = (ConstVector(x + 3 * a) - ConstVector(x + 3 * b)).squaredNorm() / target[s] - target[s];
    sum += error * error;
  }
  return sum;
}

Gram::Gram(const SpringSet& springs, const Layout& particles, const std::string& mat_type)
    : springs_(springs), particles_(particles), mat_type_(mat_type), lambda_(springs.layout, 1) {
  const PetscInt owned = springs_.owned();
  diagonal_.resize(static_cast<std::size_t>(owned));
  if (mat_type_ != "shell") {
    make_pattern();
    return;
  }
  check(MatCreateShell(springs_.layout.comm, owned, owned, PETSC_DETERMINE, PETSC_DETERMINE, this, other_.create()));
  const auto product = [](Mat matrix, Vec in, Vec out) {
    return as_petsc_callback([&] {
      Gram* self = nullptr;
      check(MatShellGetContext(matrix, &self));
      self->multiply(in, out);
    });
  };
  const auto diagonal = [](Mat matrix, Vec out) {
    return as_petsc_callback([&] {
      Gram* self = nullptr;
      double* values = nullptr;
      check(MatShellGetContext(matrix, &self));
      check(VecGetArrayWrite(out, &values));
      std::copy(self->diagonal_.begin(), self->diagonal_.end(), values);
      check(VecRestoreArrayWrite(out, &values));
    });
  };
  PetscErrorCode (*product_function)(Mat, Vec, Vec) = product;
  PetscErrorCode (*diagonal_function)(Mat, Vec) = diagonal;
  check(MatShellSetOperation(other_, MATOP_MULT, reinterpret_cast<void (*)()>(product_function)));
  check(MatShellSetOperation(other_, MATOP_MULT_TRANSPOSE, reinterpret_cast<void (*)()>(product_function)));
  check(MatShellSetOperation(other_, MATOP_GET_DIAGONAL, reinterpret_cast<void (*)()>(diagonal_function)));
  check(MatSetOption(other_, MAT_SPD, PETSC_TRUE));
}

void Gram::make_pattern() {
  const PetscInt owned = springs_.owned();
  const Incidence at = incidence(springs_, particles_.local());
  // The columns of each row, sorted by global number as PETSc stores them, with what they are made of.
  struct Column {
    PetscInt global;
    Entry entry;
  };
  std::vector<PetscInt> row_offsets{0};
  std::vector<PetscInt> columns;
  std::vector<Column> row;
  const auto add_row = [&](PetscInt s) {
    row.clear();
    row.push_back({springs_.layout.to_global(s), {s, -1}});
    for (const PetscInt particle : springs_.ends[static_cast<std::size_t>(s)]) {
      for (PetscInt k = at.offsets[static_cast<std::size_t>(particle)];
           k < at.offsets[static_cast<std::size_t>(particle) + 1]; ++k) {
        const PetscInt other = at.springs[static_cast<std::size_t>(k)];
        if (other != s) {
          row.push_back({springs_.layout.to_global(other), {other, particle}});
        }
      }
    }
    std::sort(row.begin(), row.end(), [](const Column& a, const Column& b) { return a.global < b.global; });
    const auto same = std::adjacent_find(row.begin(), row.end(),
                                         [](const Column& a, const Column& b) { return a.global == b.global; });
    if (same != row.end()) {
      throw Error("two springs of one colour join the same two particles: the mesh has faces that share two edges");
    }
    for (const Column& column : row) {
      columns.push_back(column.global);
      const bool is_mine = column.entry.spring < owned;
      (is_mine ? diagonal_entries_ : off_diagonal_entries_).push_back(column.entry);
    }
    row_offsets.push_back(static_cast<PetscInt>(columns.size()));
  };
  together(springs_.layout.comm, [&] {
    for (PetscInt s = 0; s < owned; ++s) {
      add_row(s);
    }
  });
  check(MatCreate(springs_.layout.comm, rows_.create()));
  check(MatSetSizes(rows_, owned, owned, PETSC_DETERMINE, PETSC_DETERMINE));
  check(MatSetType(rows_, MATAIJ));
  check(MatSeqAIJSetPreallocationCSR(rows_, row_offsets.data(), columns.data(), nullptr));
  check(MatMPIAIJSetPreallocationCSR(rows_, row_offsets.data(), columns.data(), nullptr));
  check(MatSetOption(rows_, MAT_SPD, PETSC_TRUE));
  check(MatSetOption(rows_, MAT_SYMMETRY_ETERNAL, PETSC_TRUE));
}

void Gram::fill(Mat block, const std::vector<Entry>& entries, const std::vector<double>& inverse_mass) {
  const PetscInt* offsets = nullptr;
  const PetscInt* columns = nullptr;
  PetscInt rows = 0;
  PetscBool done = PETSC_FALSE;
  double* values = nullptr;
  check(MatGetRowIJ(block, 0, PETSC_FALSE, PETSC_FALSE, &rows, &offsets, &columns, &done));
  check(MatSeqAIJGetArrayWrite(block, &values));
  const Eigen::Matrix3Xd& gradient = *gradient_;
  for (PetscInt s = 0; s < rows; ++s) {
    const auto first_end = springs_.ends[static_cast<std::size_t>(s)][0];
    const Eigen::Vector3d own = gradient.col(s);
    for (PetscInt k = offsets[s]; k < offsets[s + 1]; ++k) {
      const Entry& entry = entries[static_cast<std::size_t>(k)];
      if (entry.spring == s) {
        values[k] = diagonal_[static_cast<std::size_t>(s)];
        continue;
      }
      // The gradient by the shared particle has the sign of the end at which the spring has it.
      const bool same_end = (springs_.ends[static_cast<std::size_t>(entry.spring)][0] == entry.particle) ==
                            (first_end == entry.particle);
      const double product =
          inverse_mass[static_cast<std::size_t>(entry.particle)] * own.dot(gradient.col(entry.spring));
      values[k] = same_end ? product : -product;
    }
  }
  check(MatSeqAIJRestoreArrayWrite(block, &values));
  check(MatRestoreRowIJ(block, 0, PETSC_FALSE, PETSC_FALSE, &rows, &offsets, &columns, &done));
}

void Gram::update(const Eigen::Matrix3Xd& gradient, const std::vector<double>& inverse_mass, double shift) {
  gradient_ = &gradient;
  inverse_mass_ = &inverse_mass;
  double largest = 0;
  for (std::size_t s = 0; s < diagonal_.size(); ++s) {
    const auto& [a, b] = springs_.ends[s];
    diagonal_[s] = (inverse_mass[static_cast<std::size_t>(a)] + inverse_mass[static_cast<std::size_t>(b)]) *
                   gradient.col(static_cast<Eigen::Index>(s)).squaredNorm();
    largest = std::max(largest, diagonal_[s]);
  }
  MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPI_DOUBLE, MPI_MAX, springs_.layout.comm);
  largest = largest > 0 ? largest : 1;
  constexpr double negligible = 1e-14;
  for (double& entry : diagonal_) {
    entry += entry > negligible * largest ? shift * largest : largest;
  }
  if (mat_type_ == "shell") {
    check(MatAssemblyBegin(other_, MAT_FINAL_ASSEMBLY));  // Tells the preconditioner that values have changed.
    check(MatAssemblyEnd(other_, MAT_FINAL_ASSEMBLY));
    return;
  }
  Mat diagonal_block = rows_;
  Mat off_diagonal_block = nullptr;
  PetscBool several_ranks = PETSC_FALSE;
  check(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(static_cast<Mat>(rows_)), MATMPIAIJ, &several_ranks));
  if (several_ranks == PETSC_TRUE) {
    check(MatMPIAIJGetSeqAIJ(rows_, &diagonal_block, &off_diagonal_block, nullptr));
    fill(off_diagonal_block, off_diagonal_entries_, inverse_mass);
  }
  fill(diagonal_block, diagonal_entries_, inverse_mass);
  check(MatAssemblyBegin(rows_, MAT_FINAL_ASSEMBLY));
  check(MatAssemblyEnd(rows_, MAT_FINAL_ASSEMBLY));
  if (mat_type_ == "sell") {
    const bool is_first = Mat(other_) == nullptr;
    Mat sell = other_;
    check(MatConvert(rows_, MATSELL, is_first ? MAT_INITIAL_MATRIX : MAT_REUSE_MATRIX, is_first ? other_.create() : &sell));
    check(MatSetOption(other_, MAT_SPD, PETSC_TRUE));
  }
}

void Gram::apply_transpose(const Eigen::Matrix3Xd& gradient, Vec lambda, Eigen::Matrix3Xd& result) {
  const double* values = nullptr;
  check(VecGetArrayRead(lambda, &values));
  std::copy(values, values + springs_.owned(), lambda_.data());
  check(VecRestoreArrayRead(lambda, &values));
  lambda_.update_ghosts();
  result.setZero(3, particles_.local());
  for (std::size_t s = 0; s < springs_.ends.size(); ++s) {
    const auto& [a, b] = springs_.ends[s];
    const Eigen::Vector3d force = lambda_.data()[s] * gradient.col(static_cast<Eigen::Index>(s));
    result.col(a) += force;
    result.col(b) -= force;
  }
}

void Gram::multiply(Vec in, Vec out) {
  apply_transpose(*gradient_, in, particle_sum_);
  const double* lambda = lambda_.data();
  double* values = nullptr;
  check(VecGetArrayWrite(out, &values));
  for (std::size_t s = 0; s < diagonal_.size(); ++s) {
    const auto& [a, b] = springs_.ends[s];
    const double mass_a = (*inverse_mass_)[static_cast<std::size_t>(a)];
    const double mass_b = (*inverse_mass_)[static_cast<std::size_t>(b)];
    const auto own = gradient_->col(static_cast<Eigen::Index>(s));
    // The sums hold the spring's own share; the diagonal replaces it with the shifted one.
    const double without_shift = (mass_a + mass_b) * own.squaredNorm();
    values[s] = own.dot(mass_a * particle_sum_.col(a) - mass_b * particle_sum_.col(b)) +
                (diagonal_[s] - without_shift) * lambda[s];
  }
  check(VecRestoreArrayWrite(out, &values));
}

}  // namespace pellicle
