#include "projection/gram_block.h"

#include <algorithm>

#include "base/error.h"

namespace pellicle {
inline namespace projection {

GramBlock::GramBlock(const SpringSet& springs, const Layout& particles, const std::vector<PetscInt>& rows,
                     const std::vector<PetscInt>& columns, PetscInt owned_columns,
                     const std::function<bool(PetscInt, PetscInt)>& is_skipped) {
  const SpringIncidence incidence(springs, particles.local());
  // A row is sorted by global column, as PETSc stores it.
  struct Column {
    PetscInt global;
    Entry entry;
  };
  std::vector<PetscInt> row_offsets{0};
  std::vector<PetscInt> row_columns;
  std::vector<Column> row;
  PetscInt first_column = 0;
  MPI_Exscan(&owned_columns, &first_column, 1, MPIU_INT, MPI_SUM, springs.layout.comm);
  const auto add = [&](PetscInt s, PetscInt other, PetscInt signed_particle) {
    const PetscInt global = columns[static_cast<std::size_t>(other)];
    if (global >= 0 && !(is_skipped && is_skipped(s, other))) {
      row.push_back({global, {other, signed_particle}});
    }
  };
  const auto add_row = [&](PetscInt s) {
    const auto& ends = springs.ends[static_cast<std::size_t>(s)];
    add(s, s, 0);
    for (std::size_t end = 0; end < 2; ++end) {
      for (const PetscInt other : incidence[ends[end]]) {
        if (other != s) {
          const bool same_end = springs.ends[static_cast<std::size_t>(other)][end] == ends[end];
          add(s, other, 2 * ends[end] + (same_end ? 0 : 1));
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
      const Entry entry = part.entries[static_cast<std::size_t>(k)];
      const double* other = gradients + 3 * entry.spring;
      const double product = inverse_mass[static_cast<std::size_t>(entry.signed_particle >> 1)] *
                             (own[0] * other[0] + own[1] * other[1] + own[2] * other[2]);
      values[k] = (entry.signed_particle & 1) == 0 ? product : -product;
    }
  }
  for (const PetscInt k : part.diagonal) {
    values[k] = diagonal[static_cast<std::size_t>(part.entries[static_cast<std::size_t>(k)].spring)];
  }
  check(MatSeqAIJRestoreArrayWrite(matrix, &values));
  check(PetscLogFlops(6.0 * static_cast<double>(part.entries.size())));
}

void GramBlock::update(const Eigen::Matrix3Xd& gradient, const std::vector<double>& inverse_mass,
                       const std::vector<double>& diagonal) {
  Mat own = matrix_;
  PetscBool several_ranks = PETSC_FALSE;
  check(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(own), MATMPIAIJ, &several_ranks));
  if (several_ranks == PETSC_TRUE) {
    Mat foreign = nullptr;
    check(MatMPIAIJGetSeqAIJ(matrix_, &own, &foreign, nullptr));
    fill(foreign, foreign_, gradient, inverse_mass, diagonal);
  }
  fill(own, own_, gradient, inverse_mass, diagonal);
  check(MatAssemblyBegin(matrix_, MAT_FINAL_ASSEMBLY));
  check(MatAssemblyEnd(matrix_, MAT_FINAL_ASSEMBLY));
}

}  // namespace projection
}  // namespace pellicle
