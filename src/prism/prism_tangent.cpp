#include "prism/prism_tangent.h"

#include <Eigen/LU>
#include <algorithm>
#include <utility>

#include "base/error.h"
#include "parallel/collective.h"
#include "prism/block_product.h"
#include "prism/gradient_stiffness.h"
#include "solvers/ksp.h"

namespace pellicle {

namespace {

/// Of the mean of the diagonal: what a positive tangent has besides. Makes it definite where the elements alone leave
/// motions free, and changes no other.
constexpr double definite_share = 1e-6;

std::unique_ptr<ElementStiffness> make_stiffness(const PrismElements& elements, const PrismOptions& options) {
  if (options.tangent == ElementTangent::exact) {
    return std::make_unique<MetricStiffness>(elements, options.positive_elements);
  }
  return std::make_unique<GradientStiffness>(
      elements, options.tangent == ElementTangent::paper ? Director::left_out : Director::varied);
}

PrismTangent& self_of(Mat matrix) {
  PrismTangent* self = nullptr;
  check(MatShellGetContext(matrix, &self));
  return *self;
}

}  // namespace

PrismTangent::PrismTangent(const PrismElements& elements, const PrismOptions& options,
                           const std::vector<Eigen::Matrix3d>& projectors)
    : elements_(elements),
      mat_type_(options.mat_type),
      projectors_(projectors),
      stiffness_(make_stiffness(elements, options)),
      positive_(elements, true),
      in_use_(stiffness_.get()),
      lagged_(elements, true) {
  for (std::size_t i = 0; i < projectors_.size(); ++i) {
    if (projectors_[i] != Eigen::Matrix3d::Identity()) {
      constrained_.push_back(static_cast<PetscInt>(i));
    }
  }
  any_constrained_ = on_any_rank(elements_.membrane().comm(), !constrained_.empty());
  if (mat_type_ == TangentMatrix::shell) {
    make_shell();
  } else {
    make_rows();
    make_assembled();
  }
  check(MatSetOption(matrix_, MAT_SYMMETRIC, PETSC_TRUE));
  check(MatSetOption(matrix_, MAT_SYMMETRY_ETERNAL, PETSC_TRUE));
  set_matrix_options(matrix_, "prism_");
}

void PrismTangent::make_rows() {
  const Membrane& membrane = elements_.membrane();
  const Layout& vertices = membrane.particles;
  const bool upper_half = mat_type_ == TangentMatrix::sbaij;
  std::vector<std::vector<std::pair<PetscInt, PetscInt>>> columns(static_cast<std::size_t>(owned()));
  for (const std::array<PetscInt, 3>& triangle : membrane.triangles) {
    for (const PetscInt i : triangle) {
      for (const PetscInt j : triangle) {
        if (i < owned() && !(upper_half && vertices.to_global(j) < vertices.to_global(i))) {
          columns[static_cast<std::size_t>(i)].emplace_back(vertices.to_global(j), j);
        }
      }
    }
  }
  for (auto& row : columns) {
    std::sort(row.begin(), row.end());
    row.erase(std::unique(row.begin(), row.end()), row.end());
    for (const auto& [global, local] : row) {
      if (local + 1 == static_cast<PetscInt>(rows_.offsets.size())) {
        rows_.diagonal.push_back(static_cast<PetscInt>(rows_.columns.size()));
      }
      rows_.columns.push_back(global);
      rows_.local_columns.push_back(local);
    }
    rows_.offsets.push_back(static_cast<PetscInt>(rows_.columns.size()));
  }
  for (const std::array<PetscInt, 3>& triangle : membrane.triangles) {
    std::array<PetscInt, 9>& blocks = rows_.of_element.emplace_back();
    blocks.fill(-1);
    for (std::size_t a = 0; a < 3; ++a) {
      for (std::size_t b = 0; b < 3 && triangle[a] < owned(); ++b) {
        const auto& row = columns[static_cast<std::size_t>(triangle[a])];
        const std::pair<PetscInt, PetscInt> column{vertices.to_global(triangle[b]), triangle[b]};
        const auto found = std::lower_bound(row.begin(), row.end(), column);
        if (found != row.end() && *found == column) {
          blocks[3 * a + b] =
              rows_.offsets[static_cast<std::size_t>(triangle[a])] + static_cast<PetscInt>(found - row.begin());
        }
      }
    }
  }
  rows_.blocks.resize(rows_.columns.size());
}

void PrismTangent::make_assembled() {
  const Layout& vertices = elements_.membrane().particles;
  std::vector<PetscInt> own_blocks;
  std::vector<PetscInt> foreign_blocks;
  for (std::size_t i = 0; i < static_cast<std::size_t>(owned()); ++i) {
    const auto first = rows_.local_columns.begin() + rows_.offsets[i];
    const auto last = rows_.local_columns.begin() + rows_.offsets[i + 1];
    const auto own = static_cast<PetscInt>(std::count_if(first, last, [&](PetscInt j) { return j < owned(); }));
    own_blocks.push_back(own);
    foreign_blocks.push_back(static_cast<PetscInt>(last - first) - own);
  }
  check(MatCreate(vertices.comm, matrix_.create()));
  check(MatSetSizes(matrix_, 3 * owned(), 3 * owned(), PETSC_DETERMINE, PETSC_DETERMINE));
  check(MatSetType(matrix_, mat_type_.name().c_str()));
  check(MatXAIJSetPreallocation(matrix_, 3, own_blocks.data(), foreign_blocks.data(), own_blocks.data(),
                                foreign_blocks.data()));
  check(MatSetOption(matrix_, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_TRUE));
  if (mat_type_ == TangentMatrix::baij) {
    use_fast_product(matrix_);
  }
}

void PrismTangent::make_shell() {
  const Layout& vertices = elements_.membrane().particles;
  argument_ = Field(vertices, 3);
  product_.resize(3, vertices.local());
  check(MatCreateShell(vertices.comm, 3 * owned(), 3 * owned(), PETSC_DETERMINE, PETSC_DETERMINE, this,
                       matrix_.create()));
  check(MatSetBlockSize(matrix_, 3));
  PetscErrorCode (*product)(Mat, Vec, Vec) = [](Mat matrix, Vec in, Vec out) {
    return as_petsc_callback([&] { self_of(matrix).multiply(in, out); });
  };
  PetscErrorCode (*diagonal)(Mat, Vec) = [](Mat matrix, Vec out) {
    return as_petsc_callback([&] {
      PrismTangent& self = self_of(matrix);
      self.make_diagonal();
      double* values = nullptr;
      check(VecGetArrayWrite(out, &values));
      for (std::size_t i = 0; i < self.diagonal_.size(); ++i) {
        Eigen::Map<Eigen::Vector3d>(values + 3 * i) = self.diagonal_[i].diagonal();
      }
      check(VecRestoreArrayWrite(out, &values));
    });
  };
  PetscErrorCode (*inverse_blocks)(Mat, const PetscScalar**) = [](Mat matrix, const PetscScalar** values) {
    return as_petsc_callback([&] {
      PrismTangent& self = self_of(matrix);
      self.invert_diagonal();
      *values = self.inverse_.empty() ? nullptr : self.inverse_.front().data();
    });
  };
  check(MatShellSetOperation(matrix_, MATOP_MULT, reinterpret_cast<void (*)()>(product)));
  check(MatShellSetOperation(matrix_, MATOP_MULT_TRANSPOSE, reinterpret_cast<void (*)()>(product)));
  check(MatShellSetOperation(matrix_, MATOP_GET_DIAGONAL, reinterpret_cast<void (*)()>(diagonal)));
  check(MatShellSetOperation(matrix_, MATOP_INVERT_BLOCK_DIAGONAL, reinterpret_cast<void (*)()>(inverse_blocks)));
}

void PrismTangent::lag(const Field& positions, const std::vector<double>& thickness_ratio) {
  lagged_.update(positions, thickness_ratio, {{}, Eigen::Vector3d::Zero()});
}

void PrismTangent::add_lagged_product(double factor, const Field& displacement, Eigen::Matrix3Xd& result) const {
  if (factor == 0) {
    return;
  }
  Eigen::Matrix3Xd product = Eigen::Matrix3Xd::Zero(3, elements_.membrane().particles.local());
  lagged_.add_product(factor, displacement.data(), product.data());
  result += product.leftCols(owned());
}

void PrismTangent::update(const TangentInput& input) {
  const std::vector<double> no_load;
  ElementStiffness& stiffness = input.positive ? positive_ : *stiffness_;
  stiffness.update(input.positions, input.thickness_ratio,
                   {input.positive ? no_load : input.load_pressure, input.load_origin});
  in_use_ = &stiffness;
  vertex_blocks_ = input.vertex_blocks;
  lagged_factor_ = input.lagged_factor;
  diagonal_.clear();
  if (mat_type_ != TangentMatrix::shell) {
    assemble(input.positive);
  } else if (any_constrained_ || input.positive) {
    held_ = 0;
    make_diagonal();
    double sum = 0;
    for (const Eigen::Matrix3d& block : diagonal_) {
      sum += block.trace();
    }
    held_ = mean_of_diagonal(sum);
    for (Eigen::Matrix3d& block : vertex_blocks_) {
      block.diagonal().array() += input.positive ? definite_share * held_ : 0;
    }
    diagonal_.clear();
  }
  check(MatAssemblyBegin(matrix_, MAT_FINAL_ASSEMBLY));
  check(MatAssemblyEnd(matrix_, MAT_FINAL_ASSEMBLY));
}

double PrismTangent::mean_of_diagonal(double own_sum) const {
  MPI_Allreduce(MPI_IN_PLACE, &own_sum, 1, MPI_DOUBLE, MPI_SUM, elements_.membrane().comm());
  return own_sum > 0 ? own_sum / static_cast<double>(3 * elements_.membrane().particles.global) : 1;
}

void PrismTangent::add_elements(const ElementStiffness& stiffness, double factor) {
  for (std::size_t e = 0; e < rows_.of_element.size(); ++e) {
    const ElementStiffness::Blocks blocks = stiffness.element_blocks(e);
    for (std::size_t a = 0; a < 3; ++a) {
      for (std::size_t b = 0; b < 3; ++b) {
        const PetscInt k = rows_.of_element[e][3 * a + b];
        if (k >= 0) {
          rows_.blocks[static_cast<std::size_t>(k)] += factor * blocks[a][b];
        }
      }
    }
  }
}

void PrismTangent::assemble(bool positive) {
  std::fill(rows_.blocks.begin(), rows_.blocks.end(), Eigen::Matrix3d::Zero());
  add_elements(*in_use_, 1);
  if (lagged_factor_ != 0) {
    add_elements(lagged_, lagged_factor_);
  }
  const auto diagonal_block = [&](std::size_t vertex) -> Eigen::Matrix3d& {
    return rows_.blocks[static_cast<std::size_t>(rows_.diagonal[vertex])];
  };
  for (std::size_t i = 0; i < vertex_blocks_.size(); ++i) {
    diagonal_block(i) += vertex_blocks_[i];
  }
  if (any_constrained_ || positive) {
    double trace = 0;
    for (std::size_t i = 0; i < vertex_blocks_.size(); ++i) {
      for (auto k = static_cast<std::size_t>(rows_.offsets[i]); k < static_cast<std::size_t>(rows_.offsets[i + 1]);
           ++k) {
        const auto j = static_cast<std::size_t>(rows_.local_columns[k]);
        rows_.blocks[k] = (projectors_[i] * rows_.blocks[k] * projectors_[j]).eval();
      }
      trace += diagonal_block(i).trace();
    }
    const double held = mean_of_diagonal(trace);
    for (std::size_t i = 0; positive && i < vertex_blocks_.size(); ++i) {
      diagonal_block(i) += definite_share * held * projectors_[i];
    }
    for (const PetscInt i : constrained_) {
      if (i < owned()) {
        const auto vertex = static_cast<std::size_t>(i);
        diagonal_block(vertex) += held * (Eigen::Matrix3d::Identity() - projectors_[vertex]);
      }
    }
  }
  // Here and not once for all: MatConvert makes the part of other ranks' columns anew, without the option.
  check(MatSetOption(matrix_, MAT_ROW_ORIENTED, PETSC_FALSE));
  for (std::size_t i = 0; i < vertex_blocks_.size(); ++i) {
    const PetscInt row = elements_.membrane().particles.first + static_cast<PetscInt>(i);
    const auto first = static_cast<std::size_t>(rows_.offsets[i]);
    check(MatSetValuesBlocked(matrix_, 1, &row, rows_.offsets[i + 1] - rows_.offsets[i], rows_.columns.data() + first,
                              rows_.blocks[first].data(), INSERT_VALUES));
  }
}

void PrismTangent::add_diagonals(const ElementStiffness& stiffness, double factor) {
  const auto& triangles = elements_.membrane().triangles;
  for (std::size_t e = 0; e < triangles.size(); ++e) {
    const ElementStiffness::Blocks blocks = stiffness.element_blocks(e);
    for (std::size_t a = 0; a < 3; ++a) {
      if (triangles[e][a] < owned()) {
        diagonal_[static_cast<std::size_t>(triangles[e][a])] += factor * blocks[a][a];
      }
    }
  }
}

void PrismTangent::make_diagonal() {
  if (!diagonal_.empty()) {
    return;
  }
  diagonal_.assign(vertex_blocks_.begin(), vertex_blocks_.end());
  add_diagonals(*in_use_, 1);
  if (lagged_factor_ != 0) {
    add_diagonals(lagged_, lagged_factor_);
  }
  for (const PetscInt i : constrained_) {
    if (i < owned()) {
      const Eigen::Matrix3d& projector = projectors_[static_cast<std::size_t>(i)];
      Eigen::Matrix3d& block = diagonal_[static_cast<std::size_t>(i)];
      block = (projector * block * projector + held_ * (Eigen::Matrix3d::Identity() - projector)).eval();
    }
  }
}

void PrismTangent::invert_diagonal() {
  make_diagonal();
  inverse_.resize(diagonal_.size());
  std::transform(diagonal_.begin(), diagonal_.end(), inverse_.begin(),
                 [](const Eigen::Matrix3d& block) -> Eigen::Matrix3d { return block.inverse(); });
}

void PrismTangent::multiply(Vec in, Vec out) {
  const double* w = nullptr;
  double* y = nullptr;
  check(VecGetArrayRead(in, &w));
  check(VecGetArrayWrite(out, &y));
  using Vectors = Eigen::Map<const Eigen::Matrix3Xd>;
  const Vectors given(w, 3, owned());
  argument_.values().leftCols(owned()) = given;
  argument_.update_ghosts();
  for (const PetscInt i : constrained_) {
    argument_.vector(i) = projectors_[static_cast<std::size_t>(i)] * argument_.vector(i).eval();
  }
  for (PetscInt i = 0; i < owned(); ++i) {
    product_.col(i).noalias() = vertex_blocks_[static_cast<std::size_t>(i)] * argument_.vector(i);
  }
  product_.rightCols(product_.cols() - owned()).setZero();
  in_use_->add_product(1, argument_.data(), product_.data());
  if (lagged_factor_ != 0) {
    lagged_.add_product(lagged_factor_, argument_.data(), product_.data());
  }
  for (const PetscInt i : constrained_) {
    if (i < owned()) {
      product_.col(i) = projectors_[static_cast<std::size_t>(i)] * product_.col(i).eval() +
                        held_ * (given.col(i) - argument_.vector(i));
    }
  }
  Eigen::Map<Eigen::Matrix3Xd>(y, 3, owned()) = product_.leftCols(owned());
  check(VecRestoreArrayWrite(out, &y));
  check(VecRestoreArrayRead(in, &w));
}

}  // namespace pellicle
