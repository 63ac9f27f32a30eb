#include "projection/line_elimination.h"

#include <algorithm>
#include <utility>

#include "base/error.h"
#include "parallel/exchange.h"
#include "solvers/ksp.h"
#include "solvers/shell_operations.h"

namespace pellicle {
inline namespace projection {

LineMatrices::LineMatrices(const SpringSet& set, std::vector<std::vector<PetscInt>> lines) {
  std::stable_sort(lines.begin(), lines.end(), [](const auto& a, const auto& b) { return a.size() > b.size(); });
  for (std::size_t first = 0; first < lines.size(); first += lanes) {
    const std::size_t start = springs_.size();
    springs_.resize(start + lanes * lines[first].size(), -1);
    links_.resize(springs_.size());
    for (std::size_t lane = 0; lane < std::min(lanes, lines.size() - first); ++lane) {
      const std::vector<PetscInt>& line = lines[first + lane];
      for (std::size_t k = 0; k < line.size(); ++k) {
        const std::size_t unknown = start + lanes * k + lane;
        springs_[unknown] = line[k];
        if (k == 0) {
          continue;
        }
        const auto& ends = set.ends[static_cast<std::size_t>(line[k])];
        const auto& previous_ends = set.ends[static_cast<std::size_t>(line[k - 1])];
        for (std::size_t end = 0; end < 2; ++end) {
          for (std::size_t previous_end = 0; previous_end < 2; ++previous_end) {
            if (ends[end] == previous_ends[previous_end]) {
              links_[unknown] = {line[k - 1], 2 * ends[end] + (end == previous_end ? 0 : 1)};
            }
          }
        }
      }
    }
  }
  diagonal_.assign(springs_.size(), 1);
  inverse_pivot_.assign(springs_.size(), 1);
  coupling_.assign(springs_.size() + lanes, 0);
  factor_.assign(springs_.size() + lanes, 0);
}

void LineMatrices::update(const std::vector<double>& diagonal, const Eigen::Matrix3Xd& gradient,
                          const std::vector<double>& inverse_mass) {
  const double* gradients = gradient.data();
  for (std::size_t i = 0; i < springs_.size(); ++i) {
    if (springs_[i] < 0) {
      continue;
    }
    diagonal_[i] = diagonal[static_cast<std::size_t>(springs_[i])];
    const Link link = links_[i];
    if (link.spring >= 0) {
      const double* own = gradients + 3 * springs_[i];
      const double* other = gradients + 3 * link.spring;
      const double product = inverse_mass[static_cast<std::size_t>(link.signed_particle >> 1)] *
                             (own[0] * other[0] + own[1] * other[1] + own[2] * other[2]);
      coupling_[i] = (link.signed_particle & 1) == 0 ? product : -product;
    }
  }
  // Without a shift a straight line between two pins is singular: a tiny pivot stands for none.
  constexpr double negligible = 1e-12;
  Lanes inverse = Lanes::Zero();
  for (std::size_t i = 0; i < springs_.size(); i += lanes) {
    const Eigen::Map<const Lanes> entry(diagonal_.data() + i);
    const Eigen::Map<const Lanes> coupling(coupling_.data() + i);
    const Lanes factor = coupling * inverse;
    inverse = (entry - factor * coupling).max(negligible * entry).inverse();
    Eigen::Map<Lanes>(factor_.data() + i) = factor;
    Eigen::Map<Lanes>(inverse_pivot_.data() + i) = inverse;
  }
  check(PetscLogFlops(12.0 * static_cast<double>(springs_.size())));
}

void LineMatrices::multiply_and_subtract(const double* in, const double* subtrahend, double* out) const {
  Lanes before = Lanes::Zero();
  for (std::size_t i = 0; i < springs_.size(); i += lanes) {
    const Lanes own = Eigen::Map<const Lanes>(in + i);
    Lanes sum = Eigen::Map<const Lanes>(diagonal_.data() + i) * own +
                Eigen::Map<const Lanes>(coupling_.data() + i) * before - Eigen::Map<const Lanes>(subtrahend + i);
    if (i + lanes < springs_.size()) {
      sum += Eigen::Map<const Lanes>(coupling_.data() + i + lanes) * Eigen::Map<const Lanes>(in + i + lanes);
    }
    Eigen::Map<Lanes>(out + i) = sum;
    before = own;
  }
  check(PetscLogFlops(6.0 * static_cast<double>(springs_.size())));
}

void LineMatrices::solve(const double* in, double* out) const {
  Lanes value = Lanes::Zero();
  for (std::size_t i = 0; i < springs_.size(); i += lanes) {
    value = Eigen::Map<const Lanes>(in + i) - Eigen::Map<const Lanes>(factor_.data() + i) * value;
    Eigen::Map<Lanes>(out + i) = value;
  }
  value.setZero();
  for (std::size_t i = springs_.size(); i >= lanes; i -= lanes) {
    value = Eigen::Map<const Lanes>(out + i - lanes) * Eigen::Map<const Lanes>(inverse_pivot_.data() + i - lanes) -
            Eigen::Map<const Lanes>(factor_.data() + i) * value;
    Eigen::Map<Lanes>(out + i - lanes) = value;
  }
  check(PetscLogFlops(5.0 * static_cast<double>(springs_.size())));
}

namespace {

/// Copies values by spring to unknowns; 0 where they are idle.
void gather(const LineMatrices& lines, const double* by_spring, double* values) {
  for (const PetscInt spring : lines.springs()) {
    *values++ = spring < 0 ? 0 : by_spring[spring];
  }
}

void scatter(const LineMatrices& lines, const double* values, double* by_spring) {
  for (const PetscInt spring : lines.springs()) {
    if (spring >= 0) {
      by_spring[spring] = *values;
    }
    ++values;
  }
}

/// Values of a vector while it is read.
class ReadArray {
 public:
  explicit ReadArray(Vec vec) : vec_(vec) { check(VecGetArrayRead(vec_, &values_)); }
  ~ReadArray() { VecRestoreArrayRead(vec_, &values_); }
  ReadArray(const ReadArray&) = delete;
  ReadArray& operator=(const ReadArray&) = delete;
  operator const double*() const { return values_; }  // NOLINT(google-explicit-constructor)

 private:
  Vec vec_;
  const double* values_ = nullptr;
};

/// Values of a vector while it is changed.
class Array {
 public:
  explicit Array(Vec vec) : vec_(vec) { check(VecGetArray(vec_, &values_)); }
  ~Array() { VecRestoreArray(vec_, &values_); }
  Array(const Array&) = delete;
  Array& operator=(const Array&) = delete;
  operator double*() const { return values_; }  // NOLINT(google-explicit-constructor)

 private:
  Vec vec_;
  double* values_ = nullptr;
};

}  // namespace

LineElimination::LineElimination(const SpringSet& springs, const Layout& particles, const std::string& prefix)
    : LineElimination(springs, particles, prefix, find_lines(springs, particles)) {}

LineElimination::LineElimination(const SpringSet& springs, const Layout& particles, const std::string& prefix,
                                 SpringLines lines)
    : eliminated_(springs, std::move(lines.eliminated)), kept_(springs, std::move(lines.kept)) {
  MPI_Comm comm = springs.layout.comm;
  const PetscInt unknowns = kept_.size();
  PetscInt first = 0;
  MPI_Exscan(&unknowns, &first, 1, MPIU_INT, MPI_SUM, comm);
  // Global unknown of S of each local spring, or -1.
  std::vector<PetscInt> columns(springs.ends.size(), -1);
  std::vector<PetscInt> previous(springs.ends.size(), -1);  // in the line of a kept spring
  for (PetscInt i = 0; i < unknowns; ++i) {
    const PetscInt spring = kept_.springs()[static_cast<std::size_t>(i)];
    if (spring >= 0) {
      columns[static_cast<std::size_t>(spring)] = first + i;
      previous[static_cast<std::size_t>(spring)] = kept_.previous(i);
    }
  }
  update_ghosts(springs.layout, columns);
  coupling_ = std::make_unique<GramBlock>(springs, particles, eliminated_.springs(), columns, unknowns);
  const auto is_in_lines = [&previous](PetscInt row, PetscInt column) {
    return row == column || previous[static_cast<std::size_t>(row)] == column ||
           previous[static_cast<std::size_t>(column)] == row;
  };
  kept_off_lines_ = std::make_unique<GramBlock>(springs, particles, kept_.springs(), columns, unknowns, is_in_lines);
  MatInfo info;
  check(MatGetInfo(kept_off_lines_->matrix(), MAT_GLOBAL_SUM, &info));
  if (info.nz_used == 0) {
    kept_off_lines_ = nullptr;
  }
  check(MatCreateVecs(coupling_->matrix(), kept_values_.create(), eliminated_values_.create()));
  check(VecDuplicate(eliminated_values_, eliminated_right_hand_side_.create()));
  check(VecDuplicate(kept_values_, kept_right_hand_side_.create()));
  check(VecDuplicate(kept_values_, product_.create()));

  check(MatCreateShell(comm, unknowns, unknowns, PETSC_DETERMINE, PETSC_DETERMINE, this, schur_.create()));
  set_symmetric_product<&LineElimination::multiply>(schur_);
  set_definite(schur_);
  set_matrix_options(schur_, prefix);
  preconditioner_ = {{}, [this](Vec in, Vec out) { kept_.solve(ReadArray(in), Array(out)); }, words()};
  offer_preconditioner(schur_, type, preconditioner_);
}

std::string LineElimination::words() const {
  const auto count = [](const LineMatrices& lines) {
    return std::to_string(
        std::count_if(lines.springs().begin(), lines.springs().end(), [](PetscInt spring) { return spring >= 0; }));
  };
  return "tridiagonal solves along lines of springs, on this rank " + count(eliminated_) + " springs eliminated, " +
         count(kept_) + " kept";
}

void LineElimination::update(const std::vector<double>& diagonal, const Eigen::Matrix3Xd& gradient,
                             const std::vector<double>& inverse_mass) {
  eliminated_.update(diagonal, gradient, inverse_mass);
  kept_.update(diagonal, gradient, inverse_mass);
  coupling_->update(gradient, inverse_mass, diagonal);
  if (kept_off_lines_ != nullptr) {
    kept_off_lines_->update(gradient, inverse_mass, diagonal);
  }
  check(MatAssemblyBegin(schur_, MAT_FINAL_ASSEMBLY));  // Tells PETSc that values have changed.
  check(MatAssemblyEnd(schur_, MAT_FINAL_ASSEMBLY));
}

void LineElimination::multiply(Vec in, Vec out) {
  check(MatMult(coupling_->matrix(), in, eliminated_values_));
  {
    const Array values(eliminated_values_);
    eliminated_.solve(values, values);
  }
  check(MatMultTranspose(coupling_->matrix(), eliminated_values_, product_));
  kept_.multiply_and_subtract(ReadArray(in), ReadArray(product_), Array(out));
  if (kept_off_lines_ != nullptr) {
    check(MatMultAdd(kept_off_lines_->matrix(), in, out, out));
  }
}

/// Right-hand sides of both families, and of S.
void LineElimination::eliminate(Vec right_hand_side) {
  {
    const ReadArray all(right_hand_side);
    const Array eliminated(eliminated_right_hand_side_);
    gather(eliminated_, all, eliminated);
    gather(kept_, all, Array(kept_right_hand_side_));
    eliminated_.solve(eliminated, Array(eliminated_values_));
  }
  check(MatMultTranspose(coupling_->matrix(), eliminated_values_, product_));
  check(VecAXPY(kept_right_hand_side_, -1, product_));
}

/// The eliminated values from the kept ones, and all of them.
void LineElimination::substitute(Vec lambda) {
  check(MatMult(coupling_->matrix(), kept_values_, eliminated_values_));
  check(VecAYPX(eliminated_values_, -1, eliminated_right_hand_side_));
  const Array all(lambda);
  const Array eliminated(eliminated_values_);
  eliminated_.solve(eliminated, eliminated);
  scatter(eliminated_, eliminated, all);
  scatter(kept_, ReadArray(kept_values_), all);
}

StageResult LineElimination::solve(KSP ksp, Vec right_hand_side, Vec lambda) {
  eliminate(right_hand_side);
  StageResult result = pellicle::solve(ksp, kept_right_hand_side_, kept_values_);
  substitute(lambda);
  return result;
}

void LineElimination::apply(Vec in, Vec out) {
  eliminate(in);
  kept_.solve(ReadArray(kept_right_hand_side_), Array(kept_values_));
  substitute(out);
}

}  // namespace projection
}  // namespace pellicle
