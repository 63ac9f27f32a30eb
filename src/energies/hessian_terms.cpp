#include "energies/hessian_terms.h"

#include <utility>

namespace pellicle::energies {

void HessianTerms::add_differences(const std::vector<DifferenceTerm>& terms) {
  for (const DifferenceTerm& term : terms) {
    add_blocks(term);
  }
}

void HessianTerms::add_numbers(const NumberRows& rows) {
  const bool is_whole = wants_off_diagonal();
  for (PetscInt i = 0; i < owned_; ++i) {
    const std::size_t last = rows.offsets[static_cast<std::size_t>(i) + 1];
    for (std::size_t k = rows.offsets[i]; k < last && (is_whole || rows.columns[k] == i); ++k) {
      add_blocks(rows, i, k);
    }
  }
}

void HessianTerms::add_blocks(const DifferenceTerm& term) {
  const Eigen::Matrix3d block = term.block();
  const bool is_whole = wants_off_diagonal();
  for (const auto& [i, j] : {std::pair(term.a, term.b), std::pair(term.b, term.a)}) {
    if (i < owned_) {
      add_block(i, i, block);
      if (is_whole) {
        add_block(i, j, -block);
      }
    }
  }
}

void HessianTerms::add_blocks(const NumberRows& rows, PetscInt row, std::size_t entry) {
  const PetscInt column = rows.columns[entry];
  const Eigen::Matrix3d block = rows.block(row, entry);
  add_block(row, column, block);
  if (row != column && column < owned_) {
    add_block(column, row, block.transpose());
  }
}

}  // namespace pellicle::energies
