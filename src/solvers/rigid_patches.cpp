#include "solvers/rigid_patches.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "geometry/cross_matrix.h"
#include "parallel/partition.h"

namespace pellicle {
inline namespace solvers {

namespace {

/// Owned vertices joined by the edges of the elements.
CellGraph vertex_graph(const PatchedNet& net) {
  const PetscInt owned = net.vertices.owned;
  std::vector<std::vector<int>> neighbours(static_cast<std::size_t>(owned));
  for (const auto& triangle : net.triangles) {
    for (const PetscInt a : triangle) {
      for (const PetscInt b : triangle) {
        if (a < owned && b < owned && a != b) {
          neighbours[static_cast<std::size_t>(a)].push_back(static_cast<int>(b));
        }
      }
    }
  }
  CellGraph graph;
  graph.offsets.push_back(0);
  for (auto& row : neighbours) {
    std::sort(row.begin(), row.end());
    row.erase(std::unique(row.begin(), row.end()), row.end());
    graph.neighbours.insert(graph.neighbours.end(), row.begin(), row.end());
    graph.offsets.push_back(static_cast<int>(graph.neighbours.size()));
  }
  return graph;
}

using Motion = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor>;

/// Coordinates of the independent ones among six motions, (6 x as many): turns of a vertex round itself are none, and
/// what is held does not move.
/// @param gram matrix of the motions
Eigen::MatrixXd independent_motions(const Eigen::Matrix<double, 6, 6>& gram) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> solver(gram);
  constexpr double negligible = 1e-6;
  const auto count = (solver.eigenvalues().array() > negligible * gram.trace()).count();
  if (count == 6) {
    return Eigen::MatrixXd::Identity(6, 6);  // Half of its motions' entries are zero.
  }
  return solver.eigenvectors().rightCols(count);
}

/// What the rigid motions of the patches, shifts and turns, do to the vertices of this rank: (3 owned x at most 6
/// patches), AIJ. Collective.
MatHandle motions_of_patches(const PatchedNet& net, int patch_size) {
  const PetscInt owned = net.vertices.owned;
  const int patches = (static_cast<int>(owned) + patch_size - 1) / patch_size;
  std::vector<int> patch;
  together(net.vertices.comm, [&] { patch = partition_with_metis(vertex_graph(net), patches); });
  const auto patch_of = [&patch](PetscInt i) { return static_cast<std::size_t>(patch[static_cast<std::size_t>(i)]); };
  Eigen::Matrix3Xd centre = Eigen::Matrix3Xd::Zero(3, patches);
  Eigen::VectorXd count = Eigen::VectorXd::Zero(patches);
  for (PetscInt i = 0; i < owned; ++i) {
    centre.col(patch[static_cast<std::size_t>(i)]) += net.rest.col(i);
    count[patch[static_cast<std::size_t>(i)]] += 1;
  }
  centre.array().rowwise() /= count.transpose().array().max(1);
  Eigen::VectorXd radius = Eigen::VectorXd::Zero(patches);  // so that turns and shifts are of like size
  for (PetscInt i = 0; i < owned; ++i) {
    const int p = patch[static_cast<std::size_t>(i)];
    radius[p] = std::max(radius[p], (net.rest.col(i) - centre.col(p)).norm());
  }
  const auto motion_of = [&](PetscInt i) {
    const int p = patch[static_cast<std::size_t>(i)];
    Eigen::Matrix<double, 3, 6> motion;
    motion << Eigen::Matrix3d::Identity(),
        -cross_matrix(net.rest.col(i) - centre.col(p)) / (radius[p] > 0 ? radius[p] : 1);
    return Eigen::Matrix<double, 3, 6>(net.projectors[static_cast<std::size_t>(i)] * motion);
  };

  std::vector<Eigen::Matrix<double, 6, 6>> gram(static_cast<std::size_t>(patches), Eigen::Matrix<double, 6, 6>::Zero());
  for (PetscInt i = 0; i < owned; ++i) {
    gram[patch_of(i)] += motion_of(i).transpose() * motion_of(i);
  }
  std::vector<Eigen::MatrixXd> coordinates;
  std::vector<PetscInt> first_columns{0};  // of this rank
  for (const auto& matrix : gram) {
    coordinates.push_back(independent_motions(matrix));
    first_columns.push_back(first_columns.back() + static_cast<PetscInt>(coordinates.back().cols()));
  }

  MatHandle interpolation;
  check(MatCreateAIJ(net.vertices.comm, 3 * owned, first_columns.back(), PETSC_DETERMINE, PETSC_DETERMINE, 6, nullptr,
                     0, nullptr, interpolation.create()));
  check(MatSetOption(interpolation, MAT_IGNORE_ZERO_ENTRIES, PETSC_TRUE));
  PetscInt first_column = 0;
  check(MatGetOwnershipRangeColumn(interpolation, &first_column, nullptr));
  for (PetscInt i = 0; i < owned; ++i) {
    const Motion motion = motion_of(i) * coordinates[patch_of(i)];
    PetscInt rows[3];
    PetscInt columns[6];
    for (int k = 0; k < 3; ++k) {
      rows[k] = 3 * (net.vertices.first + i) + k;
    }
    for (int k = 0; k < 6; ++k) {
      columns[k] = first_column + first_columns[patch_of(i)] + k;
    }
    check(MatSetValues(interpolation, 3, rows, static_cast<PetscInt>(motion.cols()), columns, motion.data(),
                       INSERT_VALUES));
  }
  check(MatAssemblyBegin(interpolation, MAT_FINAL_ASSEMBLY));
  check(MatAssemblyEnd(interpolation, MAT_FINAL_ASSEMBLY));
  return interpolation;
}

}  // namespace

std::optional<RigidPatches> RigidPatches::of(KSP solver, Mat tangent, const PatchedNet& net, int patch_size) {
  PC pc = nullptr;
  PetscBool is_multigrid = PETSC_FALSE;
  check(KSPGetPC(solver, &pc));
  check(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(pc), PCMG, &is_multigrid));
  if (is_multigrid == PETSC_FALSE) {
    return std::nullopt;
  }
  char wanted[64] = "additive";
  PetscInt levels = 2;
  const char* prefix = nullptr;
  check(KSPGetOptionsPrefix(solver, &prefix));
  check(PetscOptionsGetString(nullptr, prefix, "-pc_mg_type", wanted, sizeof wanted, nullptr));
  check(PetscOptionsGetInt(nullptr, prefix, "-pc_mg_levels", &levels, nullptr));
  if (std::string(wanted) != "additive" || levels != 2) {
    throw Error(std::string("-") + prefix + "pc_mg_" +
                (levels != 2 ? "levels " + std::to_string(levels) : std::string("type ") + wanted) +
                ": the patches are one coarse level, added to the blocks of the diagonal; expected additive, 2 levels");
  }
  PetscBool is_whole = PETSC_FALSE;
  check(PetscObjectTypeCompareAny(reinterpret_cast<PetscObject>(tangent), &is_whole, MATSEQAIJ, MATMPIAIJ, MATSEQBAIJ,
                                  MATMPIBAIJ, ""));
  if (is_whole == PETSC_FALSE) {
    throw Error("-" + std::string(prefix) +
                "pc_type mg: needs all entries of the matrix, expected mat_type baij or aij");
  }
  RigidPatches patches;
  patches.solver_ = solver;
  patches.tangent_ = tangent;
  patches.interpolation_ = motions_of_patches(net, patch_size);
  KSP smoother = nullptr;
  PC smoother_pc = nullptr;
  check(PCMGSetLevels(pc, 2, nullptr));
  check(PCMGSetType(pc, PC_MG_ADDITIVE));
  check(PCMGSetInterpolation(pc, 1, patches.interpolation_));
  check(PCMGGetSmoother(pc, 1, &smoother));
  check(KSPGetPC(smoother, &smoother_pc));
  check(KSPSetType(smoother, KSPPREONLY));
  check(PCSetType(smoother_pc, PCPBJACOBI));
  check(PCMGGetCoarseSolve(pc, &patches.coarse_solver_));
  return patches;
}

void RigidPatches::renew() {
  lag_.renewed();
  const MatReuse reuse = coarse_ == nullptr ? MAT_INITIAL_MATRIX : MAT_REUSE_MATRIX;
  Mat rows = tangent_;
  PetscBool is_aij = PETSC_FALSE;
  check(PetscObjectTypeCompareAny(reinterpret_cast<PetscObject>(tangent_), &is_aij, MATSEQAIJ, MATMPIAIJ, ""));
  if (is_aij == PETSC_FALSE) {
    check(MatConvert(tangent_, MATAIJ, reuse, rows_.slot()));
    rows = rows_;
  }
  check(MatPtAP(rows, interpolation_, reuse, 2.0, coarse_.slot()));
  check(KSPSetOperators(coarse_solver_, coarse_, coarse_));
}

void RigidPatches::forget_pattern() {
  rows_ = {};
  coarse_ = {};
  lag_.forget();
}

}  // namespace solvers
}  // namespace pellicle
