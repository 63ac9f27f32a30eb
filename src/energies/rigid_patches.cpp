#include "energies/rigid_patches.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>

#include "base/error.h"
#include "geometry/cross_matrix.h"
#include "linear/ksp.h"
#include "linear/shell_operations.h"
#include "parallel/collective.h"
#include "parallel/exchange.h"
#include "parallel/partition.h"

namespace pellicle::energies {

namespace {

/// Owned vertices joined by the edges of triangles.
CellGraph vertex_graph(PetscInt owned, const std::vector<std::array<PetscInt, 3>>& triangles) {
  constexpr std::size_t usual = 12;  // two from each of six triangles
  std::vector<std::vector<int>> neighbours(owned);
  for (std::vector<int>& of_vertex : neighbours) {
    of_vertex.reserve(usual);
  }
  for (const auto& triangle : triangles) {
    for (const PetscInt a : triangle) {
      for (const PetscInt b : triangle) {
        if (a < owned && b < owned && a != b) {
          neighbours[a].push_back(static_cast<int>(b));
        }
      }
    }
  }
  return graph_of(std::move(neighbours));
}

Eigen::Vector4d with_arm(const Eigen::Vector3d& arm) { return {1, arm.x(), arm.y(), arm.z()}; }

/// Adds to a block for shifts and turns the contribution of numbers that couple vertices alike in all directions; a
/// turn w moves a vertex by w x arm.
/// @param moments sum of the numbers times (1, arm) of both vertices
template <class Block>
void add_to(Block& block, const Eigen::Matrix4d& moments) {
  const Eigen::Matrix3d products = moments.bottomRightCorner<3, 3>();  // of the arms
  block.template topLeftCorner<3, 3>().diagonal().array() += moments(0, 0);
  block.template topRightCorner<3, 3>() -= cross_matrix(moments.topRightCorner<1, 3>().transpose());
  block.template bottomLeftCorner<3, 3>() += cross_matrix(moments.bottomLeftCorner<3, 1>());
  block.template bottomRightCorner<3, 3>() -= products.transpose();
  block.template bottomRightCorner<3, 3>().diagonal().array() += products.trace();
}

/// Refuses options for levels that the patches do not have.
void check_options(KSP solver, TangentMatrix type) {
  const std::string option = "-" + prefix_of(solver) + "pc_mg";
  const std::string wanted = option_value(option + "_type").value_or("additive");
  PetscInt levels = 2;
  check(PetscOptionsGetInt(nullptr, nullptr, (option + "_levels").c_str(), &levels, nullptr));
  if (wanted != "additive" || levels != 2) {
    throw Error(option + (levels != 2 ? "_levels " + std::to_string(levels) : "_type " + wanted) +
                ": the patches are one coarse level, added to the blocks of the diagonal; expected additive, 2 levels");
  }
  if (type == TangentMatrix::sbaij) {
    throw Error("-" + prefix_of(solver) +
                "pc_type mg: needs all entries of the matrix, expected mat_type baij, aij or shell");
  }
}

}  // namespace

RigidPatches::RigidPatches(KSP solver, const Tangent& tangent, const std::vector<std::array<PetscInt, 3>>& triangles,
                           int patch_size)
    : tangent_(tangent) {
  check_options(solver, tangent.type());
  const Layout& vertices = tangent.vertices();
  const auto owned = static_cast<int>(vertices.owned);
  const int count = owned / patch_size + (owned % patch_size > 0 ? 1 : 0);
  std::vector<int> patch;
  together(vertices.comm, [&] { patch = split_in_patches(vertex_graph(vertices.owned, triangles), count); });
  first_patch_ = number_owned(vertices.comm, count).first;
  for (const int p : patch) {
    patch_.push_back(first_patch_ + p);
  }
  rows_.resize(count);
  movement_.resize(6, count);
  check(MatCreateShell(vertices.comm, 3 * vertices.owned, 6 * own_patches(), PETSC_DETERMINE, PETSC_DETERMINE, this,
                       interpolation_.create()));
  set_shell_operation<&RigidPatches::interpolate>(interpolation_, MATOP_MULT);
  set_shell_operation<&RigidPatches::restrict_to_patches>(interpolation_, MATOP_MULT_TRANSPOSE);
  set_levels(preconditioner_of(solver));
  number_reach();
}

/// Sets the levels of a PCMG. The coarse one is factorised with CHOLMOD, whose blocks suit patches, on several ranks by
/// substructures. Where the interface between ranks, some 2 sqrt(patches ranks) of the patches of a surface, would be
/// too large for these, algebraic multigrid shares the work: ML's, symmetric Gauss-Seidel by default.
void RigidPatches::set_levels(PC pc) {
  KSP smoother = nullptr;
  check(PCMGSetLevels(pc, 2, nullptr));
  check(PCMGSetType(pc, PC_MG_ADDITIVE));
  // PETSc would tell restriction and interpolation apart by their numbers of rows, which may be equal.
  MatHandle restriction;
  VecHandle scale;  // of restricted states, of which there are none
  check(MatCreateTranspose(interpolation_, restriction.create()));
  check(PCMGSetInterpolation(pc, 1, interpolation_));
  check(PCMGSetRestriction(pc, 1, restriction));
  check(MatCreateVecs(interpolation_, scale.create(), nullptr));
  check(PCMGSetRScale(pc, 1, scale));
  check(PCMGGetSmoother(pc, 1, &smoother));
  check(KSPSetType(smoother, KSPPREONLY));
  check(PCSetType(preconditioner_of(smoother), PCPBJACOBI));
  check(PCMGGetCoarseSolve(pc, &coarse_solver_));
  constexpr PetscInt most_in_interface = 300;
  const PC coarse_pc = preconditioner_of(coarse_solver_);
  PetscInt unknowns = 0;
  check(MatGetSize(interpolation_, nullptr, &unknowns));
  const PetscInt patches = unknowns / 6;
  const int ranks = ranks_of(tangent_.vertices().comm);
  if (ranks == 1) {
    check(PCSetType(coarse_pc, PCCHOLESKY));
    check(PCFactorSetMatSolverType(coarse_pc, MATSOLVERCHOLMOD));
  } else if (2 * std::sqrt(static_cast<double>(patches) * ranks) <= most_in_interface) {
    substructures_.precondition(coarse_pc);
  } else {
    check(PCSetType(coarse_pc, PCML));
  }
}

void RigidPatches::interpolate(Vec patches, Vec vertices) const {
  const ConstVecValues in(patches);
  VecValues out(vertices);
  for (std::size_t p = 0; p < rows_.size(); ++p) {
    movement_.col(static_cast<Eigen::Index>(p)).noalias() = basis_[p] * Eigen::Map<const Movement>(in.data() + 6 * p);
  }
  for (PetscInt i = 0; i < tangent_.vertices().owned; ++i) {
    const auto of_patch = movement_.col(local_patch(i));
    out.segment<3>(3 * i) = of_patch.head<3>() + of_patch.tail<3>().cross(arm_.col(i));
  }
  for (const PetscInt i : tangent_.bound()) {
    auto shift = out.segment<3>(3 * i);
    shift = (projector(i) * shift).eval();
  }
  check(PetscLogFlops(12.0 * tangent_.vertices().owned));
}

void RigidPatches::restrict_to_patches(Vec vertices, Vec patches) const {
  const ConstVecValues in(vertices);
  VecValues out(patches);
  movement_.setZero();
  const auto add = [this](PetscInt i, const Eigen::Vector3d& force) {
    auto of_patch = movement_.col(local_patch(i));
    of_patch.head<3>() += force;
    of_patch.tail<3>() += arm_.col(i).cross(force);
  };
  for (PetscInt i = 0; i < tangent_.vertices().owned; ++i) {
    add(i, in.segment<3>(3 * i));
  }
  for (const PetscInt i : tangent_.bound()) {
    const Eigen::Vector3d force = in.segment<3>(3 * i);
    add(i, projector(i) * force - force);
  }
  for (std::size_t p = 0; p < rows_.size(); ++p) {
    Eigen::Map<Movement>(out.data() + 6 * p).noalias() =
        basis_[p].transpose() * movement_.col(static_cast<Eigen::Index>(p));
  }
  check(PetscLogFlops(15.0 * tangent_.vertices().owned));
}

/// Finds the patches of all vertices in reach, and allocates their motions.
void RigidPatches::number_reach() {
  const Layout& reach = tangent_.reach();
  patch_.resize(reach.local());
  update_ghosts(reach, patch_);
  has_neighbours_ = on_any_rank(reach.comm, reach.local() > reach.owned);
  motions_ = has_neighbours_ ? Field(reach, 18) : Field();
}

/// Motions of an owned vertex by shifts and turns of its patch.
RigidPatches::Motion RigidPatches::of_body(PetscInt vertex) const {
  Motion motion;
  motion << Eigen::Matrix3d::Identity(), -cross_matrix(Eigen::Vector3d(arm_.col(vertex)));
  return projector(vertex) * motion;
}

/// For each patch an orthonormal basis of its rigid motions, shifts and turns of its shape at x, as far as its vertices
/// may can move so: single vertices do not turn, and constrained ones do not move.
void RigidPatches::find_motions(const Field& x) {
  centre_.setZero(3, own_patches());
  count_.setZero(own_patches());
  const PetscInt owned = tangent_.vertices().owned;
  for (PetscInt i = 0; i < owned; ++i) {
    centre_.col(local_patch(i)) += x.vector(i);
    count_[local_patch(i)] += 1;
  }
  centre_.array().rowwise() /= count_.transpose().array().max(1);
  radius_.setZero(own_patches());
  for (PetscInt i = 0; i < owned; ++i) {
    double& of_patch = radius_[local_patch(i)];
    of_patch = std::max(of_patch, (x.vector(i) - centre_.col(local_patch(i))).norm());
  }
  arm_.resize(3, owned);
  basis_.assign(rows_.size(), Gram::Zero());
  for (PetscInt i = 0; i < owned; ++i) {
    const PetscInt p = local_patch(i);
    arm_.col(i) = (x.vector(i) - centre_.col(p)) / (radius_[p] > 0 ? radius_[p] : 1);
    if (!is_bound(i)) {
      basis_[p].topLeftCorner<4, 4>() += with_arm(arm_.col(i)) * with_arm(arm_.col(i)).transpose();
    }
  }
  for (Gram& gram : basis_) {
    const Moments moments = gram.topLeftCorner<4, 4>();
    gram.setZero();
    add_to(gram, moments);
  }
  for (const PetscInt i : tangent_.bound()) {
    const Motion motion = of_body(i);
    basis_[local_patch(i)] += motion.transpose() * motion;
  }
  for (Gram& gram : basis_) {
    const Eigen::SelfAdjointEigenSolver<Gram> solver(gram);
    constexpr double negligible = 1e-6;
    const double least = negligible * gram.trace();
    for (int k = 0; k < 6; ++k) {
      const double square = solver.eigenvalues()[k];
      gram.col(k) = (square <= least ? 0 : 1 / std::sqrt(square)) * solver.eigenvectors().col(k);
    }
  }
  if (has_neighbours_) {
    for (PetscInt i = 0; i < owned; ++i) {
      motions_.values().col(i) = (of_body(i) * basis_[local_patch(i)]).reshaped();
    }
    motions_.update_ghosts();
  }
}

/// Adds up interpolation^T tangent interpolation, first for shifts and turns, and then transforms to the bases.
/// Symmetric parts are computed once, on ranks that own both sides: for a patch with itself blocks after the diagonal
/// and half of the diagonal, to which the transposed are added.
class RigidPatches::Sum : public HessianTerms {
 public:
  explicit Sum(RigidPatches& patches) : HessianTerms(patches.tangent_.vertices().owned), all_(patches) {}

  /// Sums the forces on a vertex, before their moments are taken.
  void add_block(PetscInt row, PetscInt column, const Eigen::Matrix3d& block) override {
    const PetscInt p = patch(row);
    const PetscInt q = patch(column);
    const bool is_own_column = all_.is_own(q);
    if (is_own_column && (q < p || (p == q && column < row))) {
      return;
    }
    if (row != vertex_ || q != column_patch_) {
      add_forces();
      vertex_ = row;
      column_patch_ = q;
    }
    Eigen::Matrix3d allowed = block;
    if (all_.is_bound(row)) {
      allowed = all_.projector(row) * block;
    }
    if (!is_own_column) {
      forces_.noalias() += allowed * all_.motion(column);
      return;
    }
    if (all_.is_bound(column)) {
      allowed *= all_.projector(column);
    }
    if (row == column) {
      allowed *= 0.5;
    }
    const Eigen::Vector3d arm = all_.arm_.col(column);
    forces_.leftCols<3>() += allowed;
    forces_.col(3) += arm.y() * allowed.col(2) - arm.z() * allowed.col(1);
    forces_.col(4) += arm.z() * allowed.col(0) - arm.x() * allowed.col(2);
    forces_.col(5) += arm.x() * allowed.col(1) - arm.y() * allowed.col(0);
  }

  void add_differences(const std::vector<DifferenceTerm>& terms) override {
    for (const DifferenceTerm& term : terms) {
      if (!is_free(term.a) || !is_free(term.b)) {
        add_blocks(term);
        continue;
      }
      const bool is_ordered = patch(term.a) <= patch(term.b);
      const PetscInt a = is_ordered ? term.a : term.b;
      const PetscInt b = is_ordered ? term.b : term.a;
      const PetscInt p = patch(a);
      const PetscInt q = patch(b);
      const Eigen::Vector3d arm_a = all_.arm_.col(a);
      const Eigen::Vector3d arm_b = all_.arm_.col(b);
      if (p == q) {  // Its length stays.
        if (term.across != 0) {
          const Eigen::Vector3d difference = arm_a - arm_b;
          all_.coupling(p, p).moments.bottomRightCorner<3, 3>() +=
              0.5 * term.across * difference * difference.transpose();
        }
        continue;
      }
      const Movement at_a = forces_of(term.direction, arm_a);
      const Movement at_b = forces_of(term.direction, arm_b);
      add_product<&Coupling::block>(p, p, Movement(0.5 * at_a), at_a);
      add_product<&Coupling::block>(q, q, Movement(0.5 * at_b), at_b);
      add_product<&Coupling::block>(p, q, Movement(-at_a), at_b);
      if (term.across != 0) {
        const Eigen::Vector4d place_a = with_arm(arm_a);
        const Eigen::Vector4d place_b = with_arm(arm_b);
        add_product<&Coupling::moments>(p, p, Eigen::Vector4d(0.5 * term.across * place_a), place_a);
        add_product<&Coupling::moments>(q, q, Eigen::Vector4d(0.5 * term.across * place_b), place_b);
        add_product<&Coupling::moments>(p, q, Eigen::Vector4d(-term.across * place_a), place_b);
      }
    }
  }

  void add_numbers(const NumberRows& rows) override {
    const bool has_normals = rows.along != 0;
    for (PetscInt i = 0; i < owned_; ++i) {
      const std::size_t last = rows.offsets[static_cast<std::size_t>(i) + 1];
      PetscInt q = -1;
      Eigen::Vector4d sum;  // of the numbers of a patch, times (1, arm)
      Movement along;       // of the numbers, times unit forces along the normals as forces on the patch
      const auto add_sums = [&] {
        if (q < 0) {
          return;
        }
        add_product<&Coupling::moments>(patch(i), q, with_arm(all_.arm_.col(i)), sum);
        if (has_normals) {
          const Movement own = rows.along * forces_of(rows.normals.vector(i), all_.arm_.col(i));
          add_product<&Coupling::block>(patch(i), q, own, along);
        }
      };
      for (std::size_t k = rows.offsets[i]; k < last; ++k) {
        const PetscInt j = rows.columns[k];
        if (!is_free(i) || !is_free(j)) {
          add_blocks(rows, i, k);
          continue;
        }
        if (patch(j) != q) {
          add_sums();
          q = patch(j);
          sum.setZero();
          along.setZero();
        }
        const double number = (i == j ? 0.5 : 1) * rows.entries[k];
        sum += number * with_arm(all_.arm_.col(j));
        if (has_normals) {
          along += number * forces_of(rows.normals.vector(j), all_.arm_.col(j));
        }
      }
      add_sums();
    }
  }

  /// Completes the sum after the last term.
  void finish() {
    add_forces();
    for (PetscInt p = all_.first_patch_; p < all_.first_patch_ + all_.own_patches(); ++p) {
      CoarseRow& row = all_.row(p);
      for (std::size_t k = 0; k < row.columns.size(); ++k) {
        const PetscInt q = row.columns[k];
        if (all_.is_own(q) && q < p) {
          continue;
        }
        auto& [block, moments] = row.couplings[k];
        add_to(block, moments);
        if (p == q) {
          block += block.transpose().eval();
        }
        block = (all_.basis_of(p).transpose() * block).eval();
        if (all_.is_own(q)) {
          block *= all_.basis_of(q);
          if (p != q) {
            all_.coupling(q, p).block = block.transpose();
          }
        }
      }
    }
  }

 private:
  PetscInt patch(PetscInt vertex) const { return all_.patch_[vertex]; }
  /// Whether a local vertex is this rank's and may move in all directions.
  bool is_free(PetscInt vertex) const { return vertex < owned_ && !all_.is_bound(vertex); }

  /// A force with its moment about the start of its arm.
  static Movement forces_of(const Eigen::Vector3d& force, const Eigen::Vector3d& arm) {
    Movement result;
    result << force, arm.cross(force);
    return result;
  }

  /// Adds left right^T to what couples patch p with patch q, which is stored with the first of both.
  template <auto member, class Vector>
  void add_product(PetscInt p, PetscInt q, const Vector& left, const Vector& right) {
    if (p <= q) {
      all_.coupling(p, q).*member += left * right.transpose();
    } else {
      all_.coupling(q, p).*member += right * left.transpose();
    }
  }

  void add_forces() {
    if (vertex_ < 0) {
      return;
    }
    CoarseBlock& sum = all_.coupling(patch(vertex_), column_patch_).block;
    sum.topRows<3>() += forces_;
    for (int column = 0; column < 6; ++column) {
      sum.col(column).tail<3>() += all_.arm_.col(vertex_).cross(forces_.col(column));
    }
    forces_.setZero();
  }

  RigidPatches& all_;
  PetscInt vertex_ = -1;
  PetscInt column_patch_ = -1;
  Motion forces_ = Motion::Zero();  ///< on the vertex, by motions of the patch
};

/// Returns the coupling of two patches, which is 0 if it has just been added to the row.
RigidPatches::Coupling& RigidPatches::coupling(PetscInt row, PetscInt column) {
  CoarseRow& of_patch = this->row(row);
  const auto found = std::find(of_patch.columns.begin(), of_patch.columns.end(), column);
  const std::size_t place = found - of_patch.columns.begin();
  if (found == of_patch.columns.end()) {
    of_patch.columns.push_back(column);
    of_patch.couplings.emplace_back();
    is_whole_ = false;
  }
  return of_patch.couplings[place];
}

void RigidPatches::fill_coarse() {
  const MPI_Comm comm = tangent_.vertices().comm;
  for (PetscInt p = first_patch_; p < first_patch_ + own_patches(); ++p) {
    CoarseBlock& diagonal = coupling(p, p).block;
    for (int k = 0; k < 6; ++k) {  // of any size, since nothing goes there
      diagonal(k, k) += basis_of(p).col(k).isZero(0) ? 1 : 0;
    }
  }
  if (on_any_rank(comm, !is_whole_)) {
    std::vector<PetscInt> own;
    std::vector<PetscInt> foreign;
    for (const CoarseRow& row : rows_) {
      const auto owned = std::count_if(row.columns.begin(), row.columns.end(), [&](PetscInt q) { return is_own(q); });
      own.push_back(static_cast<PetscInt>(owned));
      foreign.push_back(static_cast<PetscInt>(row.columns.size()) - own.back());
    }
    check(MatCreate(comm, coarse_.create()));
    check(MatSetSizes(coarse_, 6 * own_patches(), 6 * own_patches(), PETSC_DETERMINE, PETSC_DETERMINE));
    check(MatSetType(coarse_, MATAIJ));
    check(MatXAIJSetPreallocation(coarse_, 6, own.data(), foreign.data(), nullptr, nullptr));
    check(MatSetOption(coarse_, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_TRUE));
    set_definite(coarse_);
    substructures_.forget_pattern();
    is_whole_ = true;
  }
  for (PetscInt p = 0; p < own_patches(); ++p) {
    const CoarseRow& row = rows_[p];
    const PetscInt number = first_patch_ + p;
    for (std::size_t k = 0; k < row.columns.size(); ++k) {
      check(MatSetValuesBlocked(coarse_, 1, &number, 1, &row.columns[k], row.couplings[k].block.data(), INSERT_VALUES));
    }
  }
  check(MatAssemblyBegin(coarse_, MAT_FINAL_ASSEMBLY));
  check(MatAssemblyEnd(coarse_, MAT_FINAL_ASSEMBLY));
}

void RigidPatches::refresh(const Field& x) {
  find_motions(x);
  for (CoarseRow& row : rows_) {
    std::fill(row.couplings.begin(), row.couplings.end(), Coupling());
  }
  Sum sum(*this);
  tangent_.visit(sum);
  sum.finish();
  fill_coarse();
  check(KSPSetOperators(coarse_solver_, coarse_, coarse_));
}

void RigidPatches::forget_pattern() {
  number_reach();
  for (CoarseRow& row : rows_) {
    row.columns.clear();
    row.couplings.clear();
  }
  is_whole_ = false;
}

}  // namespace pellicle::energies
