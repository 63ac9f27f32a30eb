#include "energies/tangent.h"

#include <Eigen/LU>
#include <algorithm>
#include <utility>

#include "base/error.h"
#include "base/sorting.h"
#include "linear/ksp.h"
#include "linear/shell_operations.h"
#include "parallel/collective.h"

namespace pellicle::energies {

namespace {

/// Share of the diagonal's mean that is added to a positive tangent: it makes motions definite that the potentials
/// leave free, and hardly changes others.
constexpr double definite_share = 1e-6;

}  // namespace

Tangent::Tangent(const Layout& vertices, std::vector<Potential*> potentials, Projectors projectors,
                 const Choice<TangentMatrix>& type, const std::string& prefix)
    : vertices_(vertices), type_(type), prefix_(prefix), projectors_(std::move(projectors)) {
  for (Potential* potential : potentials) {
    parts_.push_back({potential, is_shell() && potential->multiplies(), {}, {}});
  }
  for (PetscInt i = 0; i < owned(); ++i) {
    if (!projectors_.is_free(i)) {
      bound_.push_back(i);
    }
  }
  if (is_shell()) {
    matrix_ = symmetric_shell<&Tangent::multiply>(vertices_.comm, 3 * owned(), this);
    check(MatSetBlockSize(matrix_, 3));
    set_shell_operation<&Tangent::copy_diagonal>(matrix_, MATOP_GET_DIAGONAL);
    set_shell_operation<&Tangent::give_inverse_blocks>(matrix_, MATOP_INVERT_BLOCK_DIAGONAL);
    check(MatSetOption(matrix_, MAT_SYMMETRIC, PETSC_TRUE));
    check(MatSetOption(matrix_, MAT_SYMMETRY_ETERNAL, PETSC_TRUE));
    set_matrix_options(matrix_, prefix_);
  }
  renew_pattern();
}

bool Tangent::renew_pattern() {
  PetscInt version = 0;
  for (const Part& part : parts_) {
    version += part.potential->pattern_version();
  }
  if (version == version_) {
    return false;
  }
  version_ = version;
  make_rows();
  if (is_shell()) {
    argument_ = Field(reach_, 4);
    product_.resize(4, vertices_.local());
    has_diagonal_ = false;
  } else {
    make_assembled();
  }
  return true;
}

bool Tangent::update_pattern(const Field& x) {
  for (const Part& part : parts_) {
    part.potential->update_pattern(x);
  }
  return renew_pattern();
}

/// Adds to the reach all vertices that owned vertices are coupled with, and their projectors.
void Tangent::extend_reach(const std::vector<std::vector<VertexPair>>& patterns) {
  reach_ = vertices_;
  numbers_ = LocalNumbers(reach_);
  std::vector<PetscInt> beyond;
  for (const auto& pattern : patterns) {
    for (const VertexPair& pair : pattern) {
      if (pair.row < owned() && numbers_.find(pair.column) < 0) {
        beyond.push_back(pair.column);
      }
    }
  }
  beyond = without_repeats(std::move(beyond));
  projectors_.resize(vertices_.local());
  if (on_any_rank(vertices_.comm, !beyond.empty())) {
    reach_ = with_ghosts(vertices_, beyond);
    numbers_ = LocalNumbers(reach_);
    Field projectors(reach_, 9);
    for (std::size_t i = 0; i < projectors_.size(); ++i) {
      projectors.values().col(static_cast<Eigen::Index>(i)) = projectors_[i].reshaped();
    }
    projectors.update_ghosts();
    projectors_.resize(reach_.local());
    for (PetscInt i = vertices_.local(); i < reach_.local(); ++i) {
      projectors_.bind(i, projectors.values().col(i).reshaped(3, 3));
    }
  }
  any_constrained_ = on_any_rank(vertices_.comm, !projectors_.bound().empty());
}

void Tangent::make_rows() {
  std::vector<std::vector<VertexPair>> patterns;
  for (const Part& part : parts_) {
    patterns.push_back(part.multiplies && part.potential->has_terms() ? std::vector<VertexPair>()
                                                                      : part.potential->pattern());
  }
  extend_reach(patterns);
  const auto is_wanted = [&](const VertexPair& pair) {
    return pair.row < owned() && !(type_ == TangentMatrix::sbaij && pair.column < vertices_.first + pair.row);
  };
  std::vector<std::vector<PetscInt>> columns(owned());
  for (PetscInt i = 0; !is_shell() && i < owned(); ++i) {
    columns[i].push_back(vertices_.first + i);
  }
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    for (const VertexPair& pair : patterns[p]) {
      if (!parts_[p].multiplies && is_wanted(pair)) {
        columns[pair.row].push_back(pair.column);
      }
    }
  }
  rows_ = {};
  rows_.diagonal.assign(columns.size(), -1);
  for (std::size_t i = 0; i < columns.size(); ++i) {
    std::vector<PetscInt>& row = columns[i] = without_repeats(std::move(columns[i]));
    for (const PetscInt column : row) {
      if (column == vertices_.first + static_cast<PetscInt>(i)) {
        rows_.diagonal[i] = static_cast<PetscInt>(rows_.columns.size());
      }
      rows_.columns.push_back(column);
      rows_.local_columns.push_back(numbers_.find(column));
    }
    rows_.offsets.push_back(static_cast<PetscInt>(rows_.columns.size()));
  }
  rows_.blocks.assign(rows_.columns.size(), Eigen::Matrix3d::Zero());
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    if (parts_[p].multiplies) {
      parts_[p].pairs.clear();
      for (const VertexPair& pair : patterns[p]) {
        const bool is_owned = pair.row < owned();
        parts_[p].pairs.push_back({is_owned ? pair.row : -1, is_owned ? numbers_.find(pair.column) : -1});
      }
      continue;
    }
    std::vector<PetscInt>& places = parts_[p].places;
    places.assign(patterns[p].size(), -1);
    for (std::size_t k = 0; k < places.size(); ++k) {
      const VertexPair& pair = patterns[p][k];
      if (is_wanted(pair)) {
        const auto& row = columns[pair.row];
        const auto found = std::lower_bound(row.begin(), row.end(), pair.column);
        places[k] = rows_.offsets[pair.row] + static_cast<PetscInt>(found - row.begin());
      }
    }
  }
}

void Tangent::make_assembled() {
  std::vector<PetscInt> own_blocks;
  std::vector<PetscInt> foreign_blocks;
  for (PetscInt i = 0; i < owned(); ++i) {
    const auto first = rows_.local_columns.begin() + rows_.offsets[i];
    const auto last = rows_.local_columns.begin() + rows_.offsets[i + 1];
    const auto own = static_cast<PetscInt>(std::count_if(first, last, [&](PetscInt j) { return j < owned(); }));
    own_blocks.push_back(own);
    foreign_blocks.push_back(static_cast<PetscInt>(last - first) - own);
  }
  MatHandle made;
  check(MatCreate(vertices_.comm, made.create()));
  check(MatSetSizes(made, 3 * owned(), 3 * owned(), PETSC_DETERMINE, PETSC_DETERMINE));
  check(MatSetType(made, type_.name().c_str()));
  check(MatXAIJSetPreallocation(made, 3, own_blocks.data(), foreign_blocks.data(), own_blocks.data(),
                                foreign_blocks.data()));
  check(MatSetOption(made, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_TRUE));
  if (type_ == TangentMatrix::baij) {
    use_fast_product(made);
  }
  if (matrix_ == nullptr) {
    matrix_ = std::move(made);
  } else {
    check(MatHeaderReplace(matrix_, made.slot()));
  }
  check(MatSetOption(matrix_, MAT_SYMMETRIC, PETSC_TRUE));
  check(MatSetOption(matrix_, MAT_SYMMETRY_ETERNAL, PETSC_TRUE));
  set_matrix_options(matrix_, prefix_);
}

void Tangent::update(const Field& x, double psd_blend) {
  const bool is_positive = psd_blend == Curvature::psd;
  renew_pattern();
  std::fill(rows_.blocks.begin(), rows_.blocks.end(), Eigen::Matrix3d::Zero());
  for (const Part& part : parts_) {
    part.potential->update_hessian(x, psd_blend);
    if (!part.multiplies) {
      const auto add_to_place = [&](std::size_t pair, const Eigen::Matrix3d& block) {
        if (const PetscInt place = part.places[pair]; place >= 0) {
          rows_.blocks[place] += block;
        }
      };
      part.potential->add_hessian(TakenPairs(add_to_place));
    }
  }
  has_diagonal_ = false;
  definite_ = 0;
  if (!is_shell()) {
    assemble(is_positive);
  } else if (any_constrained_ || is_positive) {
    hold(is_positive);
  }
  check(MatAssemblyBegin(matrix_, MAT_FINAL_ASSEMBLY));
  check(MatAssemblyEnd(matrix_, MAT_FINAL_ASSEMBLY));
}

/// Adds the mean of the diagonal in constrained directions, and `definite_share` of it everywhere to a positive
/// tangent.
void Tangent::hold(bool is_positive) {
  make_diagonal();
  double sum = 0;
  for (const Eigen::Matrix3d& block : diagonal_) {
    sum += block.trace();
  }
  constrained_ = mean_of_diagonal(sum);
  definite_ = is_positive ? definite_share * constrained_ : 0;
  for (Eigen::Matrix3d& block : diagonal_) {
    block.diagonal().array() += definite_;
  }
  for (const PetscInt i : bound_) {
    diagonal_[i] += (constrained_ - definite_) * (Eigen::Matrix3d::Identity() - projectors_[i]);
  }
}

double Tangent::mean_of_diagonal(double own_sum) const {
  const double sum = sum_over_ranks(vertices_.comm, own_sum);
  return sum > 0 ? sum / static_cast<double>(3 * vertices_.global) : 1;
}

void Tangent::assemble(bool is_positive) {
  const std::size_t vertices = owned();
  const auto diagonal_block = [&](std::size_t vertex) -> Eigen::Matrix3d& {
    return rows_.blocks[rows_.diagonal[vertex]];
  };
  if (any_constrained_ || is_positive) {
    double trace = 0;
    for (std::size_t i = 0; i < vertices; ++i) {
      for (std::size_t k = rows_.offsets[i]; k < static_cast<std::size_t>(rows_.offsets[i + 1]); ++k) {
        const std::size_t j = rows_.local_columns[k];
        rows_.blocks[k] = (projectors_[i] * rows_.blocks[k] * projectors_[j]).eval();
      }
      trace += diagonal_block(i).trace();
    }
    const double constrained = mean_of_diagonal(trace);
    for (std::size_t i = 0; is_positive && i < vertices; ++i) {
      diagonal_block(i) += definite_share * constrained * projectors_[i];
    }
    for (const std::size_t i : bound_) {
      diagonal_block(i) += constrained * (Eigen::Matrix3d::Identity() - projectors_[i]);
    }
  }
  // Set each time, because MatConvert makes the part of other ranks' columns anew, without the option.
  check(MatSetOption(matrix_, MAT_ROW_ORIENTED, PETSC_FALSE));
  for (std::size_t i = 0; i < vertices; ++i) {
    const PetscInt row = vertices_.first + static_cast<PetscInt>(i);
    const std::size_t first = rows_.offsets[i];
    check(MatSetValuesBlocked(matrix_, 1, &row, rows_.offsets[i + 1] - rows_.offsets[i], rows_.columns.data() + first,
                              rows_.blocks[first].data(), INSERT_VALUES));
  }
}

void Tangent::visit(HessianTerms& terms) const {
  for (PetscInt i = 0; i < owned(); ++i) {
    for (PetscInt k = rows_.offsets[i]; k < rows_.offsets[i + 1]; ++k) {
      terms.add_block(i, rows_.local_columns[k], rows_.blocks[k]);
    }
    if (definite_ > 0) {
      terms.add_block(i, i, definite_ * Eigen::Matrix3d::Identity());
    }
  }
  for (const Part& part : parts_) {
    visit_part(part, terms);
  }
}

void Tangent::visit_part(const Part& part, HessianTerms& terms) const {
  if (!part.multiplies) {
    return;
  }
  if (part.potential->has_terms()) {
    part.potential->visit(terms);
  } else {
    const auto pass_on = [&](std::size_t pair, const Eigen::Matrix3d& block) {
      if (const auto& [row, column] = part.pairs[pair]; row >= 0) {
        terms.add_block(row, column, block);
      }
    };
    part.potential->add_hessian(TakenPairs(pass_on, terms.wants_off_diagonal()));
  }
}

void Tangent::make_diagonal() {
  if (has_diagonal_) {
    return;
  }
  has_diagonal_ = true;
  diagonal_.assign(rows_.diagonal.size(), definite_ * Eigen::Matrix3d::Identity());
  for (std::size_t i = 0; i < diagonal_.size(); ++i) {
    if (const PetscInt k = rows_.diagonal[i]; k >= 0) {
      diagonal_[i] += rows_.blocks[k];
    }
  }
  const auto add_to_diagonal = [this](PetscInt row, PetscInt column, const Eigen::Matrix3d& block) {
    if (row == column) {
      diagonal_[row] += block;
    }
  };
  TakenBlocks terms(owned(), add_to_diagonal, false);
  for (const Part& part : parts_) {
    visit_part(part, terms);
  }
  for (const PetscInt i : bound_) {
    diagonal_[i] = (projectors_[i] * diagonal_[i] * projectors_[i]).eval();
  }
}

void Tangent::copy_diagonal(Vec out) {
  make_diagonal();
  VecValues values(out);
  for (std::size_t i = 0; i < diagonal_.size(); ++i) {
    values.segment<3>(3 * i) = diagonal_[i].diagonal();
  }
}

void Tangent::give_inverse_blocks(const PetscScalar** values) {
  make_diagonal();
  inverse_.resize(diagonal_.size());
  std::transform(diagonal_.begin(), diagonal_.end(), inverse_.begin(),
                 [](const Eigen::Matrix3d& block) -> Eigen::Matrix3d { return block.inverse(); });
  *values = inverse_.empty() ? nullptr : inverse_.front().data();
}

/// Product of the shell: P H P and the terms of `hold`.
void Tangent::multiply(Vec in, Vec out) {
  const ConstVecValues w(in);
  VecValues y(out);
  const Eigen::Map<const Eigen::Matrix3Xd> given(w.data(), 3, owned());
  const auto argument = [this](PetscInt i) { return Eigen::Map<Eigen::Vector3d>(argument_.data() + 4 * i); };
  for (PetscInt i = 0; i < owned(); ++i) {
    argument(i) = given.col(i);
    argument_.data()[4 * i + 3] = 0;
  }
  argument_.update_ghosts();
  for (const PetscInt i : projectors_.bound()) {
    argument(i) = projectors_[i] * argument(i).eval();
  }
  for (PetscInt i = 0; i < owned(); ++i) {
    Eigen::Vector3d sum = definite_ * argument(i);
    const std::size_t row = i;
    for (std::size_t k = rows_.offsets[row]; k < static_cast<std::size_t>(rows_.offsets[row + 1]); ++k) {
      sum.noalias() += rows_.blocks[k] * argument(rows_.local_columns[k]);
    }
    product_.col(i) << sum, 0;
  }
  check(PetscLogFlops(18.0 * static_cast<double>(rows_.blocks.size())));
  product_.rightCols(product_.cols() - owned()).setZero();
  TermProduct by_terms(owned(), vertices_.local(), argument_.data(), product_.data());
  for (const Part& part : parts_) {
    if (part.multiplies && part.potential->has_terms()) {
      part.potential->visit(by_terms);
    } else if (part.multiplies) {
      dense_argument_ = argument_.values().topRows<3>();
      dense_product_.setZero(3, vertices_.local());
      part.potential->add_product(dense_argument_.data(), dense_product_.data());
      product_.topRows<3>() += dense_product_;
    }
  }
  for (const PetscInt i : bound_) {
    product_.col(i).head<3>() =
        projectors_[i] * product_.col(i).head<3>().eval() + constrained_ * (given.col(i) - argument(i));
  }
  Eigen::Map<Eigen::Matrix3Xd>(y.data(), 3, owned()) = product_.topRows<3>().leftCols(owned());
}

}  // namespace pellicle::energies
