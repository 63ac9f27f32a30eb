#include "linear/substructures.h"

#include <cholmod.h>
#include <petscblaslapack.h>

#include <algorithm>
#include <iterator>
#include <new>
#include <utility>

#include "base/error.h"
#include "base/handle.h"
#include "base/sorting.h"
#include "linear/shell_operations.h"

namespace pellicle::linear {

/// Cholesky factor of a rank's inner unknowns i and their border b:
///
///     A = [A_ii, A_ib; A_bi, A_bb] = L L^T, L = [L_ii, 0; L_bi, L_bb], L_bb L_bb^T = A_bb - A_bi A_ii^-1 A_ib.
class Substructures::Factor {
 public:
  /// @param starts, rows of the upper half of A by columns, inner unknowns first: rows ascend, and the border's are
  /// dense
  /// @param border interface numbers of the border's unknowns, ascending
  Factor(const std::vector<int>& starts, const std::vector<int>& rows, std::vector<int> border)
      : size_(static_cast<int>(starts.size()) - 1),
        inner_(size_ - static_cast<int>(border.size())),
        border_(std::move(border)) {
    cholmod_start(&common_);
    common_.print = 0;
    common_.supernodal = CHOLMOD_SUPERNODAL;
    common_.quick_return_if_not_posdef = 1;
    const std::size_t size = size_;
    const auto count = static_cast<std::size_t>(starts.back());
    matrix_ = cholmod_allocate_sparse(size, size, count, 1, 1, 1, CHOLMOD_REAL, &common_);
    load_ = cholmod_zeros(size, 1, CHOLMOD_REAL, &common_);
    std::copy(starts.begin(), starts.end(), static_cast<int*>(matrix_->p));
    std::copy(rows.begin(), rows.end(), static_cast<int*>(matrix_->i));
    std::fill_n(values(), count, 0.0);
    if (size_ == 0) {
      return;  // which CHOLMOD does not take
    }
    // The border last.
    std::vector<int> group(size);
    std::vector<int> order(size);
    std::fill(group.begin() + inner_, group.end(), 1);
    if (cholmod_camd(matrix_, nullptr, 0, group.data(), order.data(), &common_) == 0) {
      throw std::bad_alloc();
    }
    common_.nmethods = 1;
    common_.method[0].ordering = CHOLMOD_GIVEN;
    factor_ = cholmod_analyze_p(matrix_, order.data(), nullptr, 0, &common_);
    if (factor_ == nullptr) {
      throw std::bad_alloc();
    }
    place_.resize(size);
    const int* permutation = static_cast<const int*>(factor_->Perm);
    for (int k = 0; k < size_; ++k) {
      place_[permutation[k]] = k;
      at_place_.push_back(std::max(permutation[k] - inner_, -1));
    }
  }
  ~Factor() {
    cholmod_free_sparse(&matrix_, &common_);
    cholmod_free_factor(&factor_, &common_);
    for (cholmod_dense** dense : {&load_, &solution_, &first_workspace_, &second_workspace_}) {
      cholmod_free_dense(dense, &common_);
    }
    cholmod_finish(&common_);
  }
  Factor(const Factor&) = delete;
  Factor& operator=(const Factor&) = delete;

  /// Values of the upper half of A, in the order of `rows`.
  double* values() { return static_cast<double*>(matrix_->x); }

  /// Factorises the present values, with A_bb from the lower half of the interface's matrix. @returns whether A is
  /// positive definite
  bool refresh(const Eigen::MatrixXd& interface) {
    if (size_ == 0) {
      return true;
    }
    const auto border = static_cast<Eigen::Index>(border_.size());
    const int* starts = static_cast<const int*>(matrix_->p);
    for (int b = 0; b < border; ++b) {
      double* past = values() + starts[inner_ + b + 1];  // The last entries of a column are the border's.
      for (int a = 0; a <= b; ++a) {
        past[a - b - 1] = interface(border_[b], border_[a]);
      }
    }
    if (cholmod_factorize(matrix_, factor_, &common_) == 0) {
      throw std::bad_alloc();
    }
    if (common_.status == CHOLMOD_NOT_POSDEF) {
      return false;
    }
    const int* first_column = static_cast<const int*>(factor_->super);
    const int* first_row = static_cast<const int*>(factor_->pi);
    const int* first_value = static_cast<const int*>(factor_->px);
    const int* rows = static_cast<const int*>(factor_->s);
    const double* entries = static_cast<const double*>(factor_->x);
    border_factor_.setZero(border, border);
    for (std::size_t block = 0; block < factor_->nsuper; ++block) {
      const int height = first_row[block + 1] - first_row[block];
      for (int column = first_column[block]; column < first_column[block + 1]; ++column) {
        const int b = at_place_[column];
        const int offset = column - first_column[block];
        for (int k = offset; b >= 0 && k < height; ++k) {
          const int a = at_place_[rows[first_row[block] + k]];
          border_factor_(a, b) = entries[first_value[block] + offset * height + k];
        }
      }
    }
    complement_.resize(border, border);
    if (border > 0) {
      const auto order = static_cast<PetscBLASInt>(border);
      const double minus = -1;
      const double zero = 0;
      BLASsyrk_("L", "N", &order, &order, &minus, border_factor_.data(), &order, &zero, complement_.data(), &order);
    }
    for (int b = 0; b < border; ++b) {  // An indexed view would copy the indices.
      for (int a = 0; a <= b; ++a) {
        complement_(b, a) += interface(border_[b], border_[a]);
      }
    }
    return true;
  }
  /// A_bi A_ii^-1 A_ib, its lower half.
  const Eigen::MatrixXd& complement() const { return complement_; }
  /// @param load on inner unknowns @returns load on the border, -A_bi A_ii^-1 load
  const Eigen::VectorXd& reduce(const Eigen::VectorXd& load) {
    if (size_ == 0) {
      return border_loads_;
    }
    auto given = at(load_);
    for (int k = 0; k < size_; ++k) {
      given[place_[k]] = k < inner_ ? load[k] : 0;
    }
    solve(CHOLMOD_L);
    border_values_.resize(border_factor_.rows());
    for (Eigen::Index b = 0; b < border_values_.size(); ++b) {
      border_values_[b] = at(solution_)[place_[inner_ + b]];
    }
    border_loads_.noalias() = border_factor_ * border_values_;
    return border_loads_;
  }
  /// @param interface values of all interface unknowns @param result A_ii^-1 (last load of `reduce` - A_ib border)
  void expand(const Eigen::VectorXd& interface, Eigen::VectorXd& result) {
    if (size_ == 0) {
      return;
    }
    std::swap(load_, solution_);
    for (Eigen::Index b = 0; b < border_values_.size(); ++b) {
      border_values_[b] = interface[border_[b]];
    }
    border_loads_.noalias() = border_factor_.transpose() * border_values_;
    for (Eigen::Index b = 0; b < border_loads_.size(); ++b) {
      at(load_)[place_[inner_ + b]] = border_loads_[b];
    }
    solve(CHOLMOD_Lt);
    for (int k = 0; k < inner_; ++k) {
      result[k] = at(solution_)[place_[k]];
    }
  }

 private:
  void solve(int system) {
    if (cholmod_solve2(system, factor_, load_, nullptr, &solution_, nullptr, &first_workspace_, &second_workspace_,
                       &common_) == 0) {
      throw std::bad_alloc();
    }
    check(PetscLogFlops(2.0 * static_cast<double>(factor_->xsize)));
  }
  /// Values in the order of the factor.
  Eigen::Map<Eigen::VectorXd> at(cholmod_dense* values) const {
    return {static_cast<double*>(values->x), static_cast<Eigen::Index>(size_)};
  }

  int size_;
  int inner_;
  std::vector<int> border_;
  cholmod_common common_;
  cholmod_sparse* matrix_ = nullptr;
  cholmod_factor* factor_ = nullptr;
  cholmod_dense* load_ = nullptr;
  cholmod_dense* solution_ = nullptr;
  cholmod_dense* first_workspace_ = nullptr;
  cholmod_dense* second_workspace_ = nullptr;
  std::vector<int> place_;         ///< of each unknown in the factor
  std::vector<int> at_place_;      ///< border unknown at each place in the factor, or -1
  Eigen::MatrixXd border_factor_;  ///< L_bb, rows and columns as in the border: lower only where places ascend along it
  Eigen::MatrixXd complement_;     ///< lower half
  Eigen::VectorXd border_values_;
  Eigen::VectorXd border_loads_;
};

Substructures::Substructures() = default;
Substructures::~Substructures() = default;

void Substructures::forget_pattern() { inner_factor_.reset(); }

void Substructures::precondition(PC pc) {
  check(PCSetType(pc, PCSHELL));
  check(PCShellSetName(pc, "substructures: CHOLMOD on each rank, the interface between ranks dense"));
  check(PCShellSetContext(pc, this));
  check(PCShellSetSetUp(pc, [](PC of) {
    return as_petsc_callback([&] {
      Substructures* self = nullptr;
      Mat matrix = nullptr;
      check(PCShellGetContext(of, &self));
      check(PCGetOperators(of, nullptr, &matrix));
      check(PCSetFailedReason(of, self->refresh(matrix) ? PC_NOERROR : PC_FACTOR_NUMERIC_ZEROPIVOT));
    });
  }));
  check(PCShellSetApply(pc, [](PC of, Vec in, Vec out) {
    return as_petsc_callback([&] {
      Substructures* self = nullptr;
      check(PCShellGetContext(of, &self));
      self->solve(in, out);
    });
  }));
}

void Substructures::find_pattern(Mat matrix) {
  const MPI_Comm comm = comm_of(matrix);
  PetscInt first = 0;
  PetscInt end = 0;
  check(MatGetOwnershipRange(matrix, &first, &end));
  std::vector<std::vector<PetscInt>> rows;
  for (PetscInt row = first; row < end; ++row) {
    PetscInt count = 0;
    const PetscInt* columns = nullptr;
    check(MatGetRow(matrix, row, &count, &columns, nullptr));
    rows.emplace_back(columns, columns + count);
    check(MatRestoreRow(matrix, row, &count, &columns, nullptr));
  }

  std::vector<PetscInt> later;
  for (const auto& row : rows) {
    std::copy_if(row.begin(), row.end(), std::back_inserter(later), [end](PetscInt column) { return column >= end; });
  }
  interface_ = RankInterface(comm, first, end - first, later);
  const std::vector<PetscInt>& inner = interface_.inner();
  matrix_.resize(interface_.size(), interface_.size());
  inner_values_.resize(static_cast<Eigen::Index>(inner.size()));

  std::vector<std::vector<int>> in_column(interface_.size());  // inner rows coupled with it
  std::vector<int> starts = {0};
  std::vector<int> upper;  // rows of the factor's upper half
  for (std::size_t i = 0; i < inner.size(); ++i) {
    for (const PetscInt column : rows[inner[i]]) {
      if (const int number = interface_.number(column); number >= 0) {
        in_column[number].push_back(static_cast<int>(i));
      } else if (column <= first + inner[i]) {
        upper.push_back(interface_.inner_number(column));
      }
    }
    starts.push_back(static_cast<int>(upper.size()));
  }
  std::vector<int> coupled = numbers_up_to(in_column.size());
  const auto is_alone = [&](int number) { return in_column[number].empty(); };
  coupled.erase(std::remove_if(coupled.begin(), coupled.end(), is_alone), coupled.end());
  interface_.set_border(std::move(coupled), 1);
  const std::vector<int>& border = interface_.border();
  std::vector<int> next(in_column.size());  // place of a column's next entry
  for (std::size_t b = 0; b < border.size(); ++b) {
    const auto& column = in_column[border[b]];
    next[border[b]] = static_cast<int>(upper.size());
    upper.insert(upper.end(), column.begin(), column.end());
    for (std::size_t a = 0; a <= b; ++a) {
      upper.push_back(static_cast<int>(inner.size() + a));
    }
    starts.push_back(static_cast<int>(upper.size()));
  }
  inner_factor_ = std::make_unique<Factor>(starts, upper, border);

  place_.clear();
  const auto place_of = [this](int row_number, int column_number) {
    return row_number + column_number * interface_.size();
  };
  std::vector<int> places;
  PetscInt place = 0;  // in the upper half
  for (PetscInt row = first; row < end; ++row) {
    const int own_number = interface_.number(row);
    for (const PetscInt column : rows[row - first]) {
      PetscInt to = -1;
      if (own_number < 0) {
        const int number = interface_.number(column);
        to = number >= 0 ? next[number]++ : column <= row ? place++ : -1;
      } else if (column >= row && interface_.number(column) >= 0) {
        to = static_cast<PetscInt>(places.size());
        places.push_back(place_of(interface_.number(column), own_number));
      }
      place_.push_back(to);
    }
  }
  entries_ = Entries(comm, places);
  places.clear();
  for (std::size_t a = 0; a < border.size(); ++a) {
    for (std::size_t b = a; b < border.size(); ++b) {
      places.push_back(place_of(border[b], border[a]));
    }
  }
  complements_ = Entries(comm, places);
}

void Substructures::add_to_interface(const Entries& entries, double factor) {
  entries.all.gather(entries.own.data(), gathered_);
  for (std::size_t k = 0; k < gathered_.size(); ++k) {
    matrix_.data()[entries.places[k]] += factor * gathered_[k];
  }
}

bool Substructures::refresh(Mat matrix) {
  if (inner_factor_ == nullptr) {
    find_pattern(matrix);
  }
  double* values = inner_factor_->values();
  PetscInt first = 0;
  PetscInt end = 0;
  check(MatGetOwnershipRange(matrix, &first, &end));
  auto place = place_.begin();
  for (PetscInt row = first; row < end; ++row) {
    double* to = interface_.number(row) >= 0 ? entries_.own.data() : values;
    PetscInt count = 0;
    const double* in_row = nullptr;
    check(MatGetRow(matrix, row, &count, nullptr, &in_row));
    for (PetscInt k = 0; k < count; ++k, ++place) {
      if (*place >= 0) {
        to[*place] = in_row[k];
      }
    }
    check(MatRestoreRow(matrix, row, &count, nullptr, &in_row));
  }
  matrix_.setZero();
  add_to_interface(entries_, 1);
  const bool is_definite = inner_factor_->refresh(matrix_);
  if (on_any_rank(comm_of(matrix), !is_definite)) {
    return false;
  }
  auto of_complement = complements_.own.begin();
  for (Eigen::Index a = 0; a < inner_factor_->complement().cols(); ++a) {
    const auto column = inner_factor_->complement().col(a);
    of_complement = std::copy(column.begin() + a, column.end(), of_complement);
  }
  add_to_interface(complements_, -1);
  const auto order = static_cast<PetscBLASInt>(matrix_.rows());
  PetscBLASInt not_positive = 0;
  if (order > 0) {
    LAPACKpotrf_("L", &order, matrix_.data(), &order, &not_positive);
  }
  return not_positive == 0;
}

void Substructures::solve(Vec in, Vec out) {
  const std::vector<PetscInt>& inner = interface_.inner();
  const ConstVecValues load(in);
  std::transform(inner.begin(), inner.end(), inner_values_.begin(), [&](PetscInt row) { return load[row]; });
  interface_.sum(load.data(), inner_factor_->reduce(inner_values_).data(), interface_values_);
  matrix_.triangularView<Eigen::Lower>().solveInPlace(interface_values_);
  matrix_.triangularView<Eigen::Lower>().transpose().solveInPlace(interface_values_);
  inner_factor_->expand(interface_values_, inner_values_);
  VecValues result(out);
  const auto scatter = [&result](const std::vector<PetscInt>& rows, const double* values) {
    for (const PetscInt row : rows) {
      result[row] = *values++;
    }
  };
  scatter(inner, inner_values_.data());
  scatter(interface_.own(), interface_values_.data() + interface_.own_first());
}

}  // namespace pellicle::linear
