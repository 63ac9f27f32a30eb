#include "projection/gram_block.h"

#include <algorithm>

#include "base/error.h"

namespace pellicle::projection {

PetscInt joint_of(const SpringSet& springs, PetscInt one, PetscInt other) {
  for (const std::size_t k : {1, 0}) {
    for (const std::size_t l : {1, 0}) {
      if (springs.ends[one][k] == springs.ends[other][l]) {
        return 2 * springs.ends[one][k] + (k == l ? 0 : 1);
      }
    }
  }
  return -1;
}

GramBlock::GramBlock(const SpringSet& springs, const Layout& particles, const std::vector<PetscInt>& rows,
                     const std::vector<PetscInt>& columns, PetscInt owned_columns,
                     const std::function<bool(PetscInt, PetscInt)>& is_skipped) {
  const Incidence incidence(springs.ends, particles.local());
  // A row is sorted by global column, as PETSc stores it.
  struct Column {
    PetscInt global;
    Entry entry;
  };
  std::vector<PetscInt> row_offsets{0};
  std::vector<PetscInt> row_columns;
  std::vector<Column> row;
  const PetscInt first_column = number_owned(springs.layout.comm, owned_columns).first;
  const auto add = [&](PetscInt s, PetscInt other) {
    const PetscInt global = columns[other];
    if (global >= 0 && !(is_skipped && is_skipped(s, other))) {
      row.push_back({global, {other, joint_of(springs, s, other)}});
    }
  };
  const auto add_row = [&](PetscInt s) {
    add(s, s);
    for (const PetscInt end : springs.ends[s]) {
      for (const PetscInt other : incidence[end]) {
        if (other != s) {
          add(s, other);
        }
      }
    }
    std::sort(row.begin(), row.end(), [](const Column& a, const Column& b) { return a.global < b.global; });
    const auto same = std::adjacent_find(row.begin(), row.end(),
                                         [](const Column& a, const Column& b) { return a.global == b.global; });
    if (same != row.end()) {
      throw Error("two springs of one colour join the same two particles: the mesh has faces that share two edges");
    }
  };
  together(springs.layout.comm, [&] {
    for (const PetscInt s : rows) {
      row.clear();
      if (s >= 0) {
        add_row(s);
      }
      for (const Column& column : row) {
        row_columns.push_back(column.global);
        Part& part = column.global >= first_column && column.global < first_column + owned_columns ? own_ : foreign_;
        if (column.entry.spring == s) {
          part.diagonal.push_back(static_cast<PetscInt>(part.entries.size()));
        }
        part.entries.push_back(column.entry);
      }
      row_offsets.push_back(static_cast<PetscInt>(row_columns.size()));
      for (Part* part : {&own_, &foreign_}) {
        if (static_cast<PetscInt>(part->entries.size()) > part->offsets.back()) {
          part->springs.push_back(s);
          part->offsets.push_back(static_cast<PetscInt>(part->entries.size()));
        }
      }
    }
  });
  check(MatCreate(springs.layout.comm, matrix_.create()));
  check(MatSetSizes(matrix_, static_cast<PetscInt>(rows.size()), owned_columns, PETSC_DETERMINE, PETSC_DETERMINE));
  check(MatSetType(matrix_, MATAIJ));
  check(MatSeqAIJSetPreallocationCSR(matrix_, row_offsets.data(), row_columns.data(), nullptr));
  check(MatMPIAIJSetPreallocationCSR(matrix_, row_offsets.data(), row_columns.data(), nullptr));
  check(MatSetOption(matrix_, MAT_NO_OFF_PROC_ENTRIES, PETSC_TRUE));  // No assembly needs to ask other ranks.
}

void GramBlock::fill(Mat matrix, const Part& part, const Eigen::Matrix3Xd& gradient,
                     const std::vector<double>& inverse_mass, const std::vector<double>& diagonal) {
  double* values = nullptr;
  check(MatSeqAIJGetArrayWrite(matrix, &values));
  const double* gradients = gradient.data();
  for (std::size_t row = 0; row < part.springs.size(); ++row) {
    const double* own = gradients + 3 * part.springs[row];
    for (PetscInt k = part.offsets[row]; k < part.offsets[row + 1]; ++k) {
      const Entry entry = part.entries[k];
      const double* other = gradients + 3 * entry.spring;
      const double product =
          inverse_mass[entry.joint >> 1] * (own[0] * other[0] + own[1] * other[1] + own[2] * other[2]);
      values[k] = (entry.joint & 1) == 0 ? product : -product;
    }
  }
  for (const PetscInt k : part.diagonal) {
    values[k] = diagonal[part.entries[k].spring];
  }
  check(MatSeqAIJRestoreArrayWrite(matrix, &values));
  check(PetscLogFlops(6.0 * static_cast<double>(part.entries.size())));
}

void GramBlock::update(const Eigen::Matrix3Xd& gradient, const std::vector<double>& inverse_mass,
                       const std::vector<double>& diagonal) {
  Mat own = matrix_;
  if (has_type(own, {MATMPIAIJ})) {
    Mat foreign = nullptr;
    check(MatMPIAIJGetSeqAIJ(matrix_, &own, &foreign, nullptr));
    fill(foreign, foreign_, gradient, inverse_mass, diagonal);
  }
  fill(own, own_, gradient, inverse_mass, diagonal);
  check(MatAssemblyBegin(matrix_, MAT_FINAL_ASSEMBLY));
  check(MatAssemblyEnd(matrix_, MAT_FINAL_ASSEMBLY));
}

GramRows::GramRows(Mat matrix) {
  if (!has_type(matrix, {MATMPIAIJ})) {
    own_ = rows_of(matrix);
    return;
  }
  Mat own = nullptr;
  Mat foreign = nullptr;
  const PetscInt* columns = nullptr;  // global, of the foreign part
  PetscLayout owners = nullptr;
  PetscInt rows = 0;
  PetscInt count = 0;
  check(MatMPIAIJGetSeqAIJ(matrix, &own, &foreign, &columns));
  own_ = rows_of(own);
  foreign_ = rows_of(foreign);
  check(MatGetLocalSize(foreign, &rows, &count));
  for (PetscInt row = 0; row < rows; ++row) {
    if (foreign_.offsets[row] < foreign_.offsets[row + 1]) {
      foreign_rows_.push_back(row);
    }
  }
  ghosts_.resize(count);
  changes_.resize(ghosts_.size());
  check(MatGetLayouts(matrix, nullptr, &owners));
  check(PetscSFCreate(comm_of(matrix), sf_.create()));
  check(PetscSFSetGraphLayout(sf_, owners, count, nullptr, PETSC_COPY_VALUES, columns));
  check(PetscSFSetUp(sf_));
}

GramRows::Rows GramRows::rows_of(Mat matrix) {
  const PetscInt* offsets = nullptr;
  const PetscInt* columns = nullptr;
  double* values = nullptr;
  check(MatSeqAIJGetCSRAndMemType(matrix, &offsets, &columns, &values, nullptr));
  return {offsets, columns, values};
}

std::pair<const std::size_t*, const std::size_t*> GramRows::foreign_rows(std::size_t first, std::size_t count) const {
  const std::size_t* end = foreign_rows_.data() + foreign_rows_.size();
  const std::size_t* begin = std::lower_bound(foreign_rows_.data(), end, first);
  return {begin, std::lower_bound(begin, end, first + count)};
}

void GramRows::begin(const double* in) {
  if (sf_ != nullptr) {
    check(PetscSFBcastBegin(sf_, MPIU_SCALAR, in, ghosts_.data(), MPI_REPLACE));
  }
}

void GramRows::end(const double* in) {
  if (sf_ != nullptr) {
    check(PetscSFBcastEnd(sf_, MPIU_SCALAR, in, ghosts_.data(), MPI_REPLACE));
  }
}

void GramRows::multiply(std::size_t first, std::size_t count, const double* in, double* out) const {
  const Rows own = own_;
  PetscInt k = own.offsets[first];
  for (std::size_t i = 0; i < count; ++i) {
    if (own.offsets[first + i + 1] == k + 4) {  // where a line crosses others regularly
      out[i] = (own.values[k] * in[own.columns[k]] + own.values[k + 1] * in[own.columns[k + 1]]) +
               (own.values[k + 2] * in[own.columns[k + 2]] + own.values[k + 3] * in[own.columns[k + 3]]);
      k += 4;
      continue;
    }
    double sum = 0;
    for (const PetscInt end = own.offsets[first + i + 1]; k < end; ++k) {
      sum += own.values[k] * in[own.columns[k]];
    }
    out[i] = sum;
  }
  const auto [begin, end] = foreign_rows(first, count);
  for (const std::size_t* row = begin; row != end; ++row) {
    for (PetscInt l = foreign_.offsets[*row]; l < foreign_.offsets[*row + 1]; ++l) {
      out[*row - first] += foreign_.values[l] * ghosts_[foreign_.columns[l]];
    }
  }
  check(PetscLogFlops(2.0 * (own.offsets[first + count] - own.offsets[first])));
}

void GramRows::subtract_transposed(std::size_t first, std::size_t count, const double* values, double* out) {
  const Rows own = own_;
  PetscInt k = own.offsets[first];
  for (std::size_t i = 0; i < count; ++i) {
    const double value = values[i];
    if (own.offsets[first + i + 1] == k + 4) {  // four entries at once, read before anything is written
      const double a = out[own.columns[k]] - own.values[k] * value;
      const double b = out[own.columns[k + 1]] - own.values[k + 1] * value;
      const double c = out[own.columns[k + 2]] - own.values[k + 2] * value;
      const double d = out[own.columns[k + 3]] - own.values[k + 3] * value;
      out[own.columns[k]] = a;
      out[own.columns[k + 1]] = b;
      out[own.columns[k + 2]] = c;
      out[own.columns[k + 3]] = d;
      k += 4;
      continue;
    }
    for (const PetscInt end = own.offsets[first + i + 1]; k < end; ++k) {
      out[own.columns[k]] -= own.values[k] * value;
    }
  }
  const auto [begin, end] = foreign_rows(first, count);
  for (const std::size_t* row = begin; row != end; ++row) {
    for (PetscInt l = foreign_.offsets[*row]; l < foreign_.offsets[*row + 1]; ++l) {
      changes_[foreign_.columns[l]] -= foreign_.values[l] * values[*row - first];
    }
  }
  check(PetscLogFlops(2.0 * (own.offsets[first + count] - own.offsets[first])));
}

void GramRows::send(double* out) {
  if (sf_ != nullptr) {
    check(PetscSFReduceBegin(sf_, MPIU_SCALAR, changes_.data(), out, MPIU_SUM));
    check(PetscSFReduceEnd(sf_, MPIU_SCALAR, changes_.data(), out, MPIU_SUM));
    std::fill(changes_.begin(), changes_.end(), 0);
  }
}

}  // namespace pellicle::projection
