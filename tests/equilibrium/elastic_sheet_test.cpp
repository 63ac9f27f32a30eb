#include <gtest/gtest.h>
#include <petscsys.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <map>
#include <vector>

#include "elastic/spring_sheet.h"
#include "meshing/generators.h"
#include "surface/shell.h"
#include "surface/weave_strain.h"
#include "tests/support/balanced_step.h"
#include "tests/support/grid_mesh.h"
#include "tests/support/initial_lengths.h"
#include "tests/support/solver_options.h"

namespace pellicle::elastic_sheet_test {
namespace {

constexpr double g = 9.81;

Sheet sheet_of(MPI_Comm comm, const SurfaceMesh& mesh) {
  SheetOptions options;
  options.is_one_surface = true;
  options.areal_density = 1;
  return make_sheet(comm, mesh, options);
}

using IsPinned = std::function<bool(const Eigen::Vector3d&)>;

std::vector<bool> pinned_of(const Sheet& sheet, const IsPinned& is_pinned) {
  std::vector<bool> pinned;
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    pinned.push_back(is_pinned && is_pinned(sheet.rest.col(i)));
  }
  return pinned;
}

/// An elastic sheet in motion without heat.
class Moving : public MovingSheet<ElasticSheet> {
 public:
  Moving(const Sheet& sheet, const SheetMaterial& material, const ElasticOptions& options,
         const IsPinned& is_pinned = {})
      : MovingSheet(sheet, pinned_of(sheet, is_pinned), options, material, 0.01, MaterialFactors(),
                    pinned_of(sheet, is_pinned), pinned_of(sheet, is_pinned), options) {}

  /// Kinetic and elastic energy of all ranks [J].
  double energy() const { return kinetic_energy() + step_.part.elastic_energy(positions); }

  /// Largest coordinates of the corners [m].
  Eigen::Vector3d largest() const {
    Eigen::Vector3d largest = Eigen::Vector3d::Constant(-1e9);
    for (PetscInt i = 0; i < sheet_.owned_corners; ++i) {
      largest = largest.cwiseMax(positions.vector(i));
    }
    max_over_ranks(sheet_.comm(), largest);
    return largest;
  }
};

ElasticOptions tight() {
  ElasticOptions options;
  options.snes_rtol = 1e-8;
  options.max_iterations = 200;
  return options;
}

const auto left_edge = [](const Eigen::Vector3d& r) { return std::abs(r.x()) < 1e-9; };

TEST(ElasticSheetTest, AHangingStripStretchesByHalfItsWeight) {
  SheetMaterial material;
  material.tensile_stiffness = 500;
  material.bending_stiffness = 0.1;
  for (const int cells : {10, 20}) {
    const Sheet sheet = sheet_of(PETSC_COMM_WORLD, grid_mesh(cells, cells / 5, 1.0 / cells));
    Moving motion(sheet, material, tight(), left_edge);
    for (int n = 0; n < 40; ++n) {
      motion.advance(0.1, {g, 0, 0}, 2);
    }
    EXPECT_NEAR(motion.largest().x() - 1, g / (2 * 500), 0.02 * g / (2 * 500)) << cells << " cells";
  }
}

TEST(ElasticSheetTest, AShearedStripSlidesByItsLengthOverTheShearStiffness) {
  SheetMaterial material;
  material.shear_stiffness = 200;
  material.bending_stiffness = 1;                                          // it is not to buckle
  const Sheet sheet = sheet_of(PETSC_COMM_WORLD, grid_mesh(4, 40, 0.05));  // 0.2 m long between its clamps, 2 m wide
  Moving motion(sheet, material, tight(), left_edge);
  for (int n = 0; n < 40; ++n) {
    motion.advance(0.1, {0, 0.1 * g, 0}, 2);
  }
  // Force per width of what hangs beyond x: rho g (L - x), far from the free ends.
  const double slide = 0.1 * g * 0.2 * 0.2 / (2 * 200);
  for (PetscInt i = 0; i < sheet.particles.owned; ++i) {
    if ((sheet.rest.col(i) - Eigen::Vector3d(0.2, 1, 0)).norm() < 1e-9) {
      EXPECT_NEAR(motion.positions.vector(i).y() - 1, slide, 0.03 * slide);
    }
  }
}

TEST(ElasticSheetTest, EnergyNeverGrowsAndMomentumStays) {
  for (const double tensile : {10.0, 1e5}) {
    SheetMaterial material;
    material.tensile_stiffness = tensile;
    material.bending_stiffness = 1e-5 * tensile;
    const Sheet sheet = sheet_of(PETSC_COMM_WORLD, grid_mesh(9, 7, 0.1));
    Moving motion(sheet, material, tight());
    motion.stir(0.3);
    const Eigen::Vector3d momentum = motion.momentum();
    double energy = motion.energy();
    for (int n = 0; n < 30; ++n) {
      motion.advance(0.01);
      const double now = motion.energy();
      ASSERT_LE(now, energy * (1 + 1e-9)) << "stiffness " << tensile << ", step " << n;
      energy = now;
    }
    EXPECT_LT((motion.momentum() - momentum).norm(), 1e-6);
  }
}

// The springs of a sheet that goes back pull less than its viscosity brakes: that is within a tolerance of 1.
TEST(ElasticSheetTest, AStepWhoseStartIsWithinTheToleranceMovesByInertiaAlone) {
  SheetMaterial material;
  material.damping = 0.02;
  const Sheet sheet = sheet_of(PETSC_COMM_WORLD, grid_mesh(4, 4, 0.1));
  for (const double tolerance : {1.0, 1e-2}) {
    ElasticOptions options;
    options.snes_rtol = tolerance;
    Moving motion(sheet, material, options);
    motion.positions.values() = 1.1 * sheet.rest;
    motion.velocities.values() = -sheet.rest;
    const ImplicitResult result = motion.advance(0.01);
    EXPECT_EQ(result.newton_iterations > 0, tolerance < 1);
    EXPECT_EQ(motion.positions.values() == motion.unconstrained, tolerance == 1);
  }
}

TEST(ElasticSheetTest, ACurvedSheetIsAtRestAsItWasMade) {
  const Sheet sheet = sheet_of(PETSC_COMM_WORLD, torus_mesh({24, 12}, 0.3, 0.1));
  Moving motion(sheet, SheetMaterial(), tight());
  for (int n = 0; n < 3; ++n) {
    motion.advance(0.01);
  }
  EXPECT_LT((motion.positions.values() - sheet.rest).cwiseAbs().maxCoeff(), 1e-10);
}

TEST(ElasticSheetTest, RigidMotionCostsNothing) {
  const Sheet sheet = sheet_of(PETSC_COMM_WORLD, irregular_mesh(8, 6, 0.1));
  SheetMaterial material;
  material.damping = 0;  // the sheet turns far within a step, which the damping would resist
  Moving motion(sheet, material, tight());
  motion.advance(0.01);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(1.3, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  motion.positions.values() = turn * sheet.rest;
  motion.velocities.values().setZero();
  EXPECT_LT(motion.energy(), 1e-20);
}

// What is left of the forces is then rounding of those that bend a plate: each step has converged, for all that.
TEST(ElasticSheetTest, AStiffPlateFallsFreely) {
  SurfaceMesh mesh = grid_mesh(8, 5, 0.05);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  for (Eigen::Vector3d& point : mesh.points) {
    point = turn * point;
  }
  const Sheet sheet = sheet_of(PETSC_COMM_WORLD, mesh);
  for (const double bending : {1e-3, 10.0, 1e4}) {
    SheetMaterial material;
    material.bending_stiffness = bending;
    Moving motion(sheet, material, tight());
    for (int n = 0; n < 5; ++n) {
      motion.advance(2e-3, {0, 0, -g});
    }
    EXPECT_LT((motion.velocities.values().colwise() - Eigen::Vector3d(0, 0, -g * 5 * 2e-3)).cwiseAbs().maxCoeff(),
              1e-8);
  }
}

/// Positions by persistent id after 5 steps of a sheet that hangs by its left edge.
std::map<PetscInt, Eigen::Vector3d> hang(const Sheet& sheet, TangentMatrix matrix) {
  ElasticOptions options = tight();
  options.snes_rtol = 1e-11;
  options.mat_type = matrix;
  Moving motion(sheet, SheetMaterial(), options, left_edge);
  for (int n = 0; n < 5; ++n) {
    EXPECT_GT(motion.advance(0.02, {0, 0, -g}).newton_iterations, 0);
  }
  std::map<PetscInt, Eigen::Vector3d> result;
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    result[sheet.persistent_id[i]] = motion.positions.vector(i);
  }
  return result;
}

TEST(ElasticSheetTest, AnyNumberOfRanksAndAnyMatrixGiveTheSameSheet) {
  SolverOptions solver;
  solver.set("elastic_ksp_rtol", "1e-10");
  const SurfaceMesh mesh = irregular_mesh(9, 7, 0.1);
  const auto alone = hang(sheet_of(PETSC_COMM_SELF, mesh), TangentMatrix::baij);
  for (const auto& [matrix, preconditioner] : {std::pair{TangentMatrix::baij, "mg"},
                                               {TangentMatrix::shell, "pbjacobi"},
                                               {TangentMatrix::shell, "mg"},
                                               {TangentMatrix::aij, "mg"},
                                               {TangentMatrix::sbaij, "bjacobi"}}) {
    solver.set("elastic_pc_type", preconditioner);
    for (const auto& [id, position] : hang(sheet_of(PETSC_COMM_WORLD, mesh), matrix)) {
      ASSERT_LT((position - alone.at(id)).norm(), 1e-7) << "particle " << id << ", " << preconditioner;
    }
  }
}

/// Iterations of conjugate gradients in a step of 10 ms of a sheet of 100 kN/m that is blown at, hangs by its left edge
/// and has turned as a whole.
int iterations(int cells, const std::string& preconditioner, double angle) {
  SolverOptions solver;
  if (!preconditioner.empty()) {
    solver.set("elastic_pc_type", preconditioner);
  }
  SheetMaterial material;
  material.tensile_stiffness = 1e5;
  material.shear_stiffness = 4e4;
  ElasticOptions options;
  options.max_iterations = 100;
  const Sheet sheet = sheet_of(PETSC_COMM_WORLD, grid_mesh(cells, cells, 1.0 / cells));
  Moving motion(sheet, material, options, left_edge);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()).toRotationMatrix();
  motion.positions.values() = turn * sheet.rest;
  const ImplicitResult result = motion.advance(0.01, turn * Eigen::Vector3d(30, 10, -g));
  return result.linear_iterations / std::max(1, result.newton_iterations);
}

TEST(ElasticSheetTest, RigidPatchesMindNeitherTheMeshNorHowTheSheetHasTurned) {
  const int coarse = iterations(16, "mg", 0);
  const int fine = iterations(40, "mg", 0);
  EXPECT_LT(coarse, 40);
  EXPECT_LT(fine, 40);
  EXPECT_NEAR(iterations(40, "mg", 1.5), fine, 5);
  EXPECT_GT(iterations(40, "pbjacobi", 0), 3 * fine);
  EXPECT_NEAR(iterations(40, "", 0), fine, 1) << "the default for a stiff sheet";
}

/// Iterations of Newton's method in 10 steps of a sheet that crumples.
int newton_iterations(double tolerance) {
  ElasticOptions options = tight();
  options.snes_rtol = tolerance;
  SheetMaterial material;
  material.bending_stiffness = 1e-4;
  const Sheet sheet = sheet_of(PETSC_COMM_WORLD, grid_mesh(12, 12, 0.05));
  Moving motion(sheet, material, options);
  motion.stir(1);
  int sum = 0;
  for (int n = 0; n < 10; ++n) {
    sum += motion.advance(0.01).newton_iterations;
  }
  return sum;
}

TEST(ElasticSheetTest, NewtonsMethodEndsQuadratically) {
  SolverOptions solver;
  solver.set("elastic_ksp_rtol", "1e-6");
  const int rough = newton_iterations(1e-2);
  const int exact = newton_iterations(1e-10);
  EXPECT_LE(exact, rough + 3 * 10) << "one iteration doubles the digits: 1e-2, 1e-4, 1e-8";
}

TEST(ElasticSheetTest, AFailedSolveIsAResult) {
  SolverOptions solver;
  solver.set("elastic_ksp_max_it", "1");
  const Sheet sheet = sheet_of(PETSC_COMM_WORLD, grid_mesh(9, 7, 0.1));
  const std::vector<bool> free(sheet.particles.local(), false);
  const std::vector<double> ones(free.size(), 1);
  BalancedStep<ElasticSheet> step(ElasticOptions(), sheet, SheetMaterial(), 0.01, MaterialFactors(), free, free,
                                  ElasticOptions());
  Field start(sheet.particles, 3);
  Field positions(sheet.particles, 3);
  start.values() = sheet.rest;
  positions.values() = 1.2 * sheet.rest;
  const ImplicitResult result =
      step.advance(positions, {{sheet.initial_mass, start, 0.1}, initial_lengths(sheet), ones, ones, ActiveSet(sheet)});
  EXPECT_FALSE(result.converged);
  EXPECT_EQ(result.reason, "the linear solver elastic_ did not converge (DIVERGED_ITS after 1 iterations)");
}

/// A step of a sheet whose target lengths are those of the mesh times a factor.
struct LimitedStep {
  LimitedStep(MPI_Comm comm, double factor, double limit, const IsPinned& is_pinned)
      : sheet(sheet_of(comm, grid_mesh(8, 4, 0.1))), positions(sheet.particles, 3), target(initial_lengths(sheet)) {
    Field start(sheet.particles, 3);
    start.values() = positions.values() = sheet.rest;
    for (auto& lengths : target) {
      for (double& length : lengths) {
        length *= factor;
      }
    }
    const std::vector<bool> pinned = pinned_of(sheet, is_pinned);
    const std::vector<double> ones(pinned.size(), 1);
    ElasticOptions options;
    options.snes_rtol = 1e-6;
    options.strain_limit = limit;
    SheetMaterial material;
    material.tensile_stiffness = 10;
    BalancedStep<ElasticSheet> step(options, sheet, material, 0.01, MaterialFactors(), pinned, pinned, options);
    result = step.advance(positions, {{sheet.initial_mass, start, 0.02}, target, ones, ones, ActiveSet(sheet)});
    strain = weave_strain(sheet, positions, target, ActiveSet(sheet));
  }
  Sheet sheet;
  Field positions;
  std::array<std::vector<double>, 4> target;
  ImplicitResult result;
  WeaveStrain strain;
};

TEST(ElasticSheetTest, AStepThatStartsBeyondTheLimitFindsBackAlikeOnAnyRanks) {
  SolverOptions solver;
  solver.set("elastic_ksp_rtol", "1e-10");
  const auto left = [](const Eigen::Vector3d& r) { return r.x() < 1e-9 && r.y() < 1e-9; };
  const LimitedStep alone(PETSC_COMM_SELF, 0.8, 0.02, left);  // at first strained by 25 %
  ASSERT_TRUE(alone.result.converged) << alone.result.reason;
  EXPECT_LE(alone.strain.largest, 0.02);
  const LimitedStep together(PETSC_COMM_WORLD, 0.8, 0.02, left);
  ASSERT_TRUE(together.result.converged) << together.result.reason;
  EXPECT_EQ(together.result.newton_iterations, alone.result.newton_iterations);
  std::map<PetscInt, Eigen::Vector3d> places;
  for (PetscInt i = 0; i < alone.sheet.particles.local(); ++i) {
    places[alone.sheet.persistent_id[i]] = alone.positions.vector(i);
  }
  for (PetscInt i = 0; i < together.sheet.particles.local(); ++i) {
    const PetscInt id = together.sheet.persistent_id[i];
    EXPECT_LT((together.positions.vector(i) - places.at(id)).norm(), 1e-6) << id;
  }
}

TEST(ElasticSheetTest, ALimitThatCannotBeKeptIsPassed) {
  const auto ends = [](const Eigen::Vector3d& r) { return r.x() < 1e-9 || r.x() > 0.8 - 1e-9; };
  const LimitedStep step(PETSC_COMM_WORLD, 0.8, 0.02, ends);
  EXPECT_GT(step.strain.largest, 0.02) << "which the motion of a sheet refuses";
}

}  // namespace
}  // namespace pellicle::elastic_sheet_test
