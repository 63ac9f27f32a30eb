// All springs in one system, in place of one colour after the other.

#include <gtest/gtest.h>

#include <cmath>

#include "projection/joint_gram.h"
#include "projection/successive_projection.h"
#include "surface/weave_strain.h"
#include "tests/projection/sheets.h"
#include "tests/support/grid_mesh.h"
#include "tests/support/solver_options.h"

namespace pellicle {
namespace {

ProjectOptions joint_options() {
  ProjectOptions options = tight_options();
  options.method = ProjectMethod::joint;
  options.shift = 1e-3;
  return options;
}

Sheet small_sheet() {
  SheetOptions options;
  options.thickness = 0.03;
  return make_sheet(PETSC_COMM_WORLD, grid_mesh(5, 4, 0.1), options);
}

/// All owned springs: gradient rows, errors, and what solving them densely gives. On one rank.
struct Dense {
  explicit Dense(const Scene& scene) {
    for (const Colour colour : all_colours) {
      const auto index = static_cast<std::size_t>(colour);
      Linearisation& constraint = linearisation[index];
      linearise(scene.sheet.of(colour), scene.x.data(), scene.target[index], scene.active.springs[index], constraint);
      for (Eigen::Index s = 0; s < constraint.error.size(); ++s) {
        const auto& [a, b] = scene.sheet.of(colour).ends[s];
        Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(3 * scene.sheet.particles.local());
        row.segment<3>(3 * a) = constraint.gradient.col(s);
        row.segment<3>(3 * b) = -constraint.gradient.col(s);
        rows.push_back(row);
        error.push_back(constraint.error[s]);
        largest = std::max(largest, constraint.gradient.col(s).squaredNorm());
      }
    }
  }

  /// What the particles are moved by, W J^T (J W J^T + shift)^-1 C. @param inverse_mass of the particles
  Eigen::VectorXd displacement(const Eigen::VectorXd& inverse_mass, double shift) const {
    Eigen::MatrixXd jacobian(static_cast<Eigen::Index>(rows.size()), rows[0].size());
    for (std::size_t s = 0; s < rows.size(); ++s) {
      jacobian.row(static_cast<Eigen::Index>(s)) = rows[s];
    }
    Eigen::VectorXd weights(rows[0].size());
    for (Eigen::Index i = 0; i < inverse_mass.size(); ++i) {
      weights.segment<3>(3 * i).setConstant(inverse_mass[i]);
    }
    const Eigen::MatrixXd spread = weights.asDiagonal() * jacobian.transpose();
    Eigen::MatrixXd gram = jacobian * spread;
    gram.diagonal().array() += shift * 4 * largest;  // 2 * inverse mass at edges, 2
    const Eigen::VectorXd errors = Eigen::Map<const Eigen::VectorXd>(error.data(), gram.rows());
    return spread * gram.ldlt().solve(errors);
  }

  std::array<Linearisation, 4> linearisation;
  std::vector<Eigen::RowVectorXd> rows;
  std::vector<double> error;
  double largest = 0;
};

void disturb(Scene& scene, double amplitude) {
  for (PetscInt i = 0; i < scene.sheet.particles.local(); ++i) {
    const double id = scene.sheet.persistent_id[i];
    scene.x.vector(i) += amplitude * Eigen::Vector3d(std::sin(3 * id), std::cos(5 * id), std::sin(7 * id));
  }
}

TEST(JointProjection, IsOneNewtonStepOfAllSprings) {
  if (ranks() > 1) {
    GTEST_SKIP() << "the dense system is of one rank";
  }
  Scene scene(small_sheet());
  disturb(scene, 0.004);
  scene.pinned[0] = true;
  const Dense dense(scene);
  double mean = 0;
  for (const double mass : scene.mass) {
    mean += mass / static_cast<double>(scene.mass.size());
  }
  Eigen::VectorXd inverse_mass(scene.sheet.particles.local());
  for (Eigen::Index i = 0; i < inverse_mass.size(); ++i) {
    inverse_mass[i] = scene.pinned[i] ? 0 : mean / scene.mass[i];
  }
  const Eigen::VectorXd before = scene.x.values().reshaped();
  const Eigen::VectorXd expected = before - dense.displacement(inverse_mass, 1e-3);
  ProjectOptions options = joint_options();
  options.max_steps = 1;
  SuccessiveProjection projection(scene.sheet, options);
  const StageResult result = projection.advance(scene.x, scene.input());
  ASSERT_TRUE(result.converged) << result.reason;
  EXPECT_LE((Eigen::VectorXd(scene.x.values().reshaped()) - expected).norm(), 1e-8 * (expected - before).norm());
  EXPECT_GT((expected - before).norm(), 1e-3);
}

TEST(JointProjection, EachStepIsMonitored) {
  Scene scene(small_sheet());
  disturb(scene, 0.002);
  ProjectOptions options = joint_options();
  options.max_steps = 3;
  options.monitor = true;
  SuccessiveProjection projection(scene.sheet, options);
  const StageResult result = projection.advance(scene.x, scene.input());
  ASSERT_TRUE(result.converged) << result.reason;
  const auto& curve = projection.monitored();
  ASSERT_EQ(curve.size(), 4U);
  for (int step = 0; step <= 3; ++step) {
    EXPECT_EQ(curve[step].step, step);
    EXPECT_FALSE(curve[step].projected.has_value());
  }
  EXPECT_LT(curve[3].total, curve[0].total);
}

TEST(JointProjection, LengthsAreMetAndMomentumIsKept) {
  Scene scene(small_sheet());
  disturb(scene, 0.002);
  const auto momentum = [&] {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (PetscInt i = 0; i < scene.sheet.particles.owned; ++i) {
      sum += scene.mass[i] * scene.x.vector(i);
    }
    MPI_Allreduce(MPI_IN_PLACE, sum.data(), 3, MPI_DOUBLE, MPI_SUM, scene.sheet.comm());
    return sum;
  };
  const Eigen::Vector3d before = momentum();
  ProjectOptions options = joint_options();
  options.max_steps = 30;
  SuccessiveProjection projection(scene.sheet, options);
  const StageResult result = projection.advance(scene.x, scene.input());
  ASSERT_TRUE(result.converged) << result.reason;
  EXPECT_LE(result.error, 1e-8);
  EXPECT_LE((momentum() - before).norm(), 1e-14);
}

TEST(JointProjection, IsTheSameOnAnyNumberOfRanks) {
  Scene scene(small_sheet());
  disturb(scene, 0.004);
  ProjectOptions options = joint_options();
  options.max_steps = 2;
  SuccessiveProjection(scene.sheet, options).advance(scene.x, scene.input());
  const Eigen::MatrixXd all = by_id(scene.sheet, scene.x);
  Scene alone([] {
    SheetOptions sheet;
    sheet.thickness = 0.03;
    return make_sheet(PETSC_COMM_SELF, grid_mesh(5, 4, 0.1), sheet);
  }());
  disturb(alone, 0.004);
  SuccessiveProjection(alone.sheet, options).advance(alone.x, alone.input());
  EXPECT_LE((all - by_id(alone.sheet, alone.x)).cwiseAbs().maxCoeff(), 1e-10);
}

TEST(JointProjection, DeadSpringsDoNothing) {
  Scene scene(small_sheet());
  disturb(scene, 0.004);
  for (auto& springs : scene.active.springs) {
    springs.assign(springs.size(), false);
  }
  const Eigen::MatrixXd before = scene.x.values();
  ProjectOptions options = joint_options();
  options.max_steps = 1;
  SuccessiveProjection(scene.sheet, options).advance(scene.x, scene.input());
  EXPECT_EQ(before, scene.x.values());
}

TEST(JointProjection, PullIsThatOfASpringAlone) {
  // One spring: both methods are the same.
  const auto pull_of = [](const char* method) {
    Eigen::Matrix3Xd rest = Eigen::Matrix3Xd::Zero(3, 2);
    rest(0, 1) = 1;
    Scene scene(hand_made_sheet(rest, {{Colour::blue, {{0, 1}}}}));
    scene.x.vector(1)[0] = 1.1;
    scene.pinned[0] = true;
    ProjectOptions options = tight_options();
    options.method = method;
    options.max_steps = 1;
    std::array<std::vector<double>, 4> pull;
    ProjectionInput input = scene.input();
    input.pull = &pull;
    SuccessiveProjection(scene.sheet, options).advance(scene.x, input);
    return pull[static_cast<std::size_t>(Colour::blue)].at(0);
  };
  EXPECT_GT(pull_of("joint"), 0.09);
  EXPECT_NEAR(pull_of("joint"), pull_of("successive"), 1e-12);
}

}  // namespace
}  // namespace pellicle
