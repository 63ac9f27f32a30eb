#include "projection/spring_baseline.h"

#include <gtest/gtest.h>
#include <petscsys.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <complex>
#include <map>

#include "surface/shell.h"
#include "tests/support/grid_mesh.h"
#include "tests/support/initial_lengths.h"

namespace pellicle {
namespace {

constexpr double g = 9.81;

/// A chain of particles along x at distance `length`, all on the first rank: the others have nothing to do.
Sheet chain(PetscInt particles, double length, double mass) {
  int rank = 0;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  const auto layout = [rank](PetscInt items) { return number_owned(PETSC_COMM_WORLD, rank == 0 ? items : 0); };
  Sheet sheet;
  sheet.particles = layout(particles);
  const PetscInt here = sheet.particles.owned;
  sheet.rest.setZero(3, here);
  sheet.initial_mass.assign(static_cast<std::size_t>(here), mass);
  for (SpringSet& set : sheet.springs) {
    set.layout = layout(0);
  }
  SpringSet& blue = sheet.of(Colour::blue);
  blue.layout = layout(particles - 1);
  for (PetscInt i = 0; i < here; ++i) {
    sheet.rest(0, i) = static_cast<double>(i) * length;
    if (i > 0) {
      blue.ends.push_back({i - 1, i});
      blue.initial_length.push_back(length);
    }
  }
  return sheet;
}

/// A sheet in motion without heat: external force, springs, velocity update.
class Motion {
 public:
  Motion(const Sheet& sheet, std::vector<bool> pinned, const SpringOptions& options)
      : positions(sheet.particles, 3),
        velocities(sheet.particles, 3),
        sheet_(sheet),
        pinned_(std::move(pinned)),
        stiffness_(options.stiffness),
        springs_(sheet, options),
        start_(sheet.particles, 3) {
    positions.values() = sheet.rest;
  }
  Motion(const Sheet& sheet, const SpringOptions& options)
      : Motion(sheet, std::vector<bool>(static_cast<std::size_t>(sheet.particles.local()), false), options) {}

  StageResult advance(double h, const Eigen::Vector3d& gravity = {0, 0, 0}) {
    start_.values() = positions.values();
    for (PetscInt i = 0; i < sheet_.particles.local(); ++i) {
      if (!pinned_[static_cast<std::size_t>(i)]) {
        velocities.vector(i) += h * gravity;
        positions.vector(i) += h * velocities.vector(i);
      }
    }
    unconstrained = positions.values();
    StageResult result =
        springs_.advance(positions, {initial_lengths(sheet_), sheet_.initial_mass, pinned_, Living(sheet_), start_, h});
    EXPECT_TRUE(result.converged) << result.reason;
    velocities.values() = (positions.values() - start_.values()) / h;
    return result;
  }

  /// Kinetic energy and that of the springs, of all ranks [J].
  double energy() const {
    double energy = 0;
    for (PetscInt i = 0; i < sheet_.particles.owned; ++i) {
      energy += 0.5 * sheet_.initial_mass[static_cast<std::size_t>(i)] * velocities.vector(i).squaredNorm();
    }
    for (const SpringSet& set : sheet_.springs) {
      for (PetscInt s = 0; s < set.owned(); ++s) {
        const auto [a, b] = set.ends[static_cast<std::size_t>(s)];
        const double stretch =
            (positions.vector(a) - positions.vector(b)).norm() - set.initial_length[static_cast<std::size_t>(s)];
        energy += 0.5 * stiffness_ * stretch * stretch;
      }
    }
    MPI_Allreduce(MPI_IN_PLACE, &energy, 1, MPI_DOUBLE, MPI_SUM, sheet_.comm());
    return energy;
  }

  /// Sum of mass times `values` of the owned particles of all ranks.
  Eigen::Vector3d weighted_sum(const Eigen::Matrix3Xd& values) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (PetscInt i = 0; i < sheet_.particles.owned; ++i) {
      sum += sheet_.initial_mass[static_cast<std::size_t>(i)] * values.col(i);
    }
    MPI_Allreduce(MPI_IN_PLACE, sum.data(), 3, MPI_DOUBLE, MPI_SUM, sheet_.comm());
    return sum;
  }

  Field positions;
  Field velocities;
  Eigen::Matrix3Xd unconstrained;

 private:
  const Sheet& sheet_;
  std::vector<bool> pinned_;
  double stiffness_;
  SpringBaseline springs_;
  Field start_;
};

class SpringBaselineTest : public ::testing::Test {
 protected:
  SpringBaselineTest() { set("-spring_ksp_rtol", "1e-13"); }
  ~SpringBaselineTest() override {
    for (const std::string& name : names_) {
      PetscOptionsClearValue(nullptr, name.c_str());
    }
  }
  void set(const std::string& name, const char* value) {
    PetscOptionsSetValue(nullptr, name.c_str(), value);
    names_.push_back(name);
  }

  static Sheet grid(MPI_Comm comm) {
    SheetOptions options;
    options.thickness = 0.03;
    options.areal_density = 1;
    return make_sheet(comm, grid_mesh(9, 7, 0.1), options);
  }

  /// Velocities that depend on the persistent ids only.
  static void stir(const Sheet& sheet, Field& velocities, double speed) {
    for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
      const auto id = static_cast<double>(sheet.persistent_id[static_cast<std::size_t>(i)]);
      velocities.vector(i) = speed * Eigen::Vector3d(std::sin(7 * id), std::sin(11 * id + 1), std::sin(13 * id + 2));
    }
  }

 private:
  std::vector<std::string> names_;
};

TEST_F(SpringBaselineTest, oscillator_follows_backward_euler_and_its_frequency) {
  const double mass = 0.5;
  SpringOptions options;
  options.stiffness = 200;
  const double omega = std::sqrt(options.stiffness / mass);
  const double h = 1e-3;
  const Sheet sheet = chain(2, 1, mass);
  std::vector<bool> pinned(static_cast<std::size_t>(sheet.particles.local()), false);
  const bool here = !pinned.empty();
  if (here) {
    pinned[0] = true;
  }
  Motion motion(sheet, pinned, options);
  if (here) {
    motion.positions.vector(1).x() = 1.01;
  }
  double last = 0.01;
  double quarter_period = 0;
  for (int n = 1; n <= 200; ++n) {
    motion.advance(h);
    if (here) {
      const double stretch = motion.positions.vector(1).x() - 1;
      ASSERT_NEAR(stretch, 0.01 * std::real(std::pow(std::complex<double>(1, -omega * h), -n)), 1e-12);
      if (quarter_period == 0 && stretch < 0) {
        quarter_period = h * (n - stretch / (stretch - last));
      }
      last = stretch;
    }
  }
  if (here) {
    EXPECT_NEAR(std::acos(-1.0) / 2 / quarter_period, omega, 1e-3 * omega);
  }
}

TEST_F(SpringBaselineTest, dashpot_damps_as_its_coefficient_says) {
  const double mass = 0.5;
  const double h = 0.01;
  SpringOptions options;
  options.damping = 0.02;
  const Sheet sheet = chain(2, 1, mass);
  std::vector<bool> pinned(static_cast<std::size_t>(sheet.particles.local()), false);
  const bool here = !pinned.empty();
  if (here) {
    pinned[0] = true;
  }
  Motion motion(sheet, pinned, options);
  if (here) {
    motion.positions.vector(1).x() = 1.01;
  }
  const double k = options.stiffness;
  const double c = k * options.damping;
  double x = 0.01;
  double v = 0;
  for (int n = 0; n < 20; ++n) {
    motion.advance(h);
    v = (v - h * k / mass * x) / (1 + h * c / mass + h * h * k / mass);
    x += h * v;
    if (here) {
      ASSERT_NEAR(motion.positions.vector(1).x() - 1, x, 1e-14);
    }
  }
}

TEST_F(SpringBaselineTest, hanging_chain_stretches_by_the_weight_below) {
  const PetscInt particles = 6;
  const double mass = 0.1;
  SpringOptions options;
  options.stiffness = 50;
  options.damping = 0.05;
  const Sheet sheet = chain(particles, 0.2, mass);
  std::vector<bool> pinned(static_cast<std::size_t>(sheet.particles.local()), false);
  if (!pinned.empty()) {
    pinned[0] = true;
  }
  Motion motion(sheet, pinned, options);
  for (int n = 0; n < 200; ++n) {
    motion.advance(0.1, {g, 0, 0});
  }
  for (PetscInt i = 1; i < sheet.particles.owned; ++i) {
    const double length = motion.positions.vector(i).x() - motion.positions.vector(i - 1).x();
    EXPECT_NEAR(length, 0.2 + static_cast<double>(particles - i) * mass * g / options.stiffness, 1e-9);
  }
}

TEST_F(SpringBaselineTest, free_sheet_keeps_its_momentum_and_its_springs_give_no_torque) {
  const Sheet sheet = grid(PETSC_COMM_WORLD);
  SpringOptions options;
  options.newton_steps = 100;
  options.newton_tolerance = 1e-8;
  options.damping = 0.01;
  Motion motion(sheet, options);
  motion.positions.values().topRows(1) *= 1.05;
  stir(sheet, motion.velocities, 0.5);
  const Eigen::Vector3d momentum = motion.weighted_sum(motion.velocities.values());
  for (int n = 0; n < 5; ++n) {
    const StageResult result = motion.advance(0.01);
    EXPECT_LT(result.error, 1e-9) << "Newton's method has converged";
    Eigen::Matrix3Xd torque(3, sheet.particles.local());
    for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
      torque.col(i) = motion.positions.vector(i).cross(motion.positions.vector(i) - motion.unconstrained.col(i));
    }
    EXPECT_LT(motion.weighted_sum(torque).norm(), 1e-7 * motion.weighted_sum(torque.cwiseAbs()).norm());
  }
  EXPECT_LT((motion.weighted_sum(motion.velocities.values()) - momentum).norm(), 1e-10);
}

TEST_F(SpringBaselineTest, energy_never_grows_in_free_motion) {
  const Sheet sheet = grid(PETSC_COMM_WORLD);
  for (const double stiffness : {10.0, 1e5}) {
    SpringOptions options;
    options.stiffness = stiffness;
    Motion motion(sheet, options);
    stir(sheet, motion.velocities, 0.5);
    double energy = motion.energy();
    for (int n = 0; n < 30; ++n) {
      motion.advance(0.01);
      const double now = motion.energy();
      ASSERT_LE(now, energy * (1 + 1e-10)) << "stiffness " << stiffness << ", step " << n;
      energy = now;
    }
  }
}

/// Positions by persistent id after 10 steps of a sheet that hangs by two corners.
std::map<PetscInt, Eigen::Vector3d> hang(const Sheet& sheet) {
  std::vector<bool> pinned;
  for (const PetscInt id : sheet.persistent_id) {
    pinned.push_back(id == 70 || id == 79);
  }
  SpringOptions options;
  options.stiffness = 1000;
  options.newton_tolerance = 1e-7;
  Motion motion(sheet, pinned, options);
  for (int n = 0; n < 10; ++n) {
    EXPECT_GT(motion.advance(0.01, {0, 0, -g}).iterations, 0);
  }
  std::map<PetscInt, Eigen::Vector3d> result;
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    result[sheet.persistent_id[static_cast<std::size_t>(i)]] = motion.positions.vector(i);
    if (pinned[static_cast<std::size_t>(i)]) {
      EXPECT_EQ(motion.positions.vector(i), sheet.rest.col(i));
    }
  }
  return result;
}

TEST_F(SpringBaselineTest, any_number_of_ranks_and_any_solver_give_the_same_sheet) {
  const std::map<PetscInt, Eigen::Vector3d> alone = hang(grid(PETSC_COMM_SELF));
  EXPECT_LT(alone.at(4).z(), -0.02) << "it has fallen";
  const auto compare = [&alone](const char* what) {
    for (const auto& [id, position] : hang(grid(PETSC_COMM_WORLD))) {
      ASSERT_LT((position - alone.at(id)).norm(), 1e-9) << what << ", particle " << id;
    }
  };
  compare("pbjacobi");
  set("-spring_pc_type", "bjacobi");
  compare("bjacobi");
  set("-spring_ksp_type", "gmres");
  set("-spring_mat_type", "aij");
  set("-spring_pc_type", "gamg");
  compare("gamg");
  set("-spring_ksp_type", "preonly");
  set("-spring_pc_type", "lu");
  set("-spring_pc_factor_mat_solver_type", "mumps");
  compare("mumps");
}

TEST_F(SpringBaselineTest, springs_without_length_or_direction_are_harmless) {
  Sheet sheet = chain(3, 0, 0.1);
  Motion motion(sheet, SpringOptions());
  motion.advance(0.01, {0, 0, -g});
  for (PetscInt i = 0; i < sheet.particles.owned; ++i) {
    EXPECT_NEAR(motion.positions.vector(i).z(), -g * 1e-4, 1e-15);
  }
}

TEST_F(SpringBaselineTest, an_absolute_tolerance_that_moves_nothing_is_a_failed_solve) {
  const Sheet sheet = grid(PETSC_COMM_WORLD);
  Field start(sheet.particles, 3);
  start.values() = sheet.rest;
  const std::vector<bool> pinned(static_cast<std::size_t>(sheet.particles.local()), false);
  const auto advance = [&](const char* tolerance, double stretch) {
    set("-spring_ksp_atol", tolerance);
    SpringBaseline springs(sheet, SpringOptions());
    Field positions(sheet.particles, 3);
    positions.values() = stretch * sheet.rest;
    return springs.advance(positions, {initial_lengths(sheet), sheet.initial_mass, pinned, Living(sheet), start, 0.1});
  };
  const StageResult result = advance("1e20", 1.2);
  EXPECT_FALSE(result.converged);
  EXPECT_EQ(result.reason.find("the linear solver spring_ (cg) does not solve: it leaves 1.0e+00 of"), 0U)
      << result.reason;
  EXPECT_TRUE(advance("1e-6", 1.2).converged);
  EXPECT_TRUE(advance("1e-6", 1 + 1e-12).converged) << "and where there is nothing to solve";
}

TEST_F(SpringBaselineTest, failed_solve_is_a_result) {
  set("-spring_ksp_max_it", "1");
  const Sheet sheet = grid(PETSC_COMM_WORLD);
  SpringBaseline springs(sheet, SpringOptions());
  Field start(sheet.particles, 3);
  Field positions(sheet.particles, 3);
  start.values() = sheet.rest;
  positions.values() = 1.2 * sheet.rest;
  const std::vector<bool> pinned(static_cast<std::size_t>(sheet.particles.local()), false);
  const StageResult result =
      springs.advance(positions, {initial_lengths(sheet), sheet.initial_mass, pinned, Living(sheet), start, 0.1});
  EXPECT_FALSE(result.converged);
  EXPECT_EQ(result.reason, "the linear solver spring_ did not converge (DIVERGED_ITS after 1 iterations)");
}

}  // namespace
}  // namespace pellicle
