#include "elastic/spring_sheet.h"

#include <gtest/gtest.h>
#include <petscsys.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <complex>
#include <map>

#include "surface/shell.h"
#include "tests/support/balanced_step.h"
#include "tests/support/grid_mesh.h"
#include "tests/support/initial_lengths.h"

namespace pellicle::spring_sheet_test {
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
  sheet.initial_mass.assign(here, mass);
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

/// A mass-spring sheet in motion without heat.
class Moving : public MovingSheet<SpringSheet> {
 public:
  Moving(const Sheet& sheet, const std::vector<bool>& pinned, const SpringOptions& options)
      : MovingSheet(sheet, pinned, options, options, pinned, 0.01, std::vector<Potential*>()),
        stiffness_(options.stiffness) {}
  Moving(const Sheet& sheet, const SpringOptions& options)
      : Moving(sheet, std::vector<bool>(static_cast<std::size_t>(sheet.particles.local()), false), options) {}

  /// Kinetic energy and that of the springs, of all ranks [J].
  double energy() const {
    double energy = 0;
    for (const SpringSet& set : sheet_.springs) {
      for (PetscInt s = 0; s < set.owned(); ++s) {
        const auto [a, b] = set.ends[s];
        const double stretch = (positions.vector(a) - positions.vector(b)).norm() - set.initial_length[s];
        energy += 0.5 * stiffness_ * stretch * stretch;
      }
    }
    return kinetic_energy() + sum_over_ranks(sheet_.comm(), energy);
  }

 private:
  double stiffness_;
};

class SpringSheetTest : public ::testing::Test {
 protected:
  SpringSheetTest() { set("-spring_ksp_rtol", "1e-13"); }
  ~SpringSheetTest() override {
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

 private:
  std::vector<std::string> names_;
};

TEST_F(SpringSheetTest, OscillatorFollowsBackwardEulerAndItsFrequency) {
  const double mass = 0.5;
  SpringOptions options;
  options.stiffness = 200;
  options.newton_tolerance = 1e-7;
  const double omega = std::sqrt(options.stiffness / mass);
  const double h = 1e-3;
  const Sheet sheet = chain(2, 1, mass);
  std::vector<bool> pinned(sheet.particles.local(), false);
  const bool here = !pinned.empty();
  if (here) {
    pinned[0] = true;
  }
  Moving motion(sheet, pinned, options);
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

TEST_F(SpringSheetTest, DashpotDampsAsItsCoefficientSays) {
  const double mass = 0.5;
  const double h = 0.01;
  SpringOptions options;
  options.damping = 0.02;
  options.newton_tolerance = 1e-8;
  const Sheet sheet = chain(2, 1, mass);
  std::vector<bool> pinned(sheet.particles.local(), false);
  const bool here = !pinned.empty();
  if (here) {
    pinned[0] = true;
  }
  Moving motion(sheet, pinned, options);
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

TEST_F(SpringSheetTest, HangingChainStretchesByTheWeightBelow) {
  const PetscInt particles = 6;
  const double mass = 0.1;
  SpringOptions options;
  options.stiffness = 50;
  options.damping = 0.05;
  const Sheet sheet = chain(particles, 0.2, mass);
  std::vector<bool> pinned(sheet.particles.local(), false);
  if (!pinned.empty()) {
    pinned[0] = true;
  }
  Moving motion(sheet, pinned, options);
  for (int n = 0; n < 200; ++n) {
    motion.advance(0.1, {g, 0, 0});
  }
  for (PetscInt i = 1; i < sheet.particles.owned; ++i) {
    const double length = motion.positions.vector(i).x() - motion.positions.vector(i - 1).x();
    EXPECT_NEAR(length, 0.2 + static_cast<double>(particles - i) * mass * g / options.stiffness, 1e-9);
  }
}

TEST_F(SpringSheetTest, FreeSheetKeepsItsMomentumAndItsSpringsGiveNoTorque) {
  const Sheet sheet = grid(PETSC_COMM_WORLD);
  SpringOptions options;
  options.max_iterations = 100;
  options.newton_tolerance = 1e-8;
  options.damping = 0.01;
  Moving motion(sheet, options);
  motion.positions.values().topRows(1) *= 1.05;
  motion.stir(0.5);
  const Eigen::Vector3d momentum = motion.momentum();
  for (int n = 0; n < 5; ++n) {
    const ImplicitResult result = motion.advance(0.01);
    EXPECT_LT(result.residual, 1e-5) << "Newton's method has converged";
    Eigen::Matrix3Xd torque(3, sheet.particles.local());
    for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
      torque.col(i) = motion.positions.vector(i).cross(motion.positions.vector(i) - motion.unconstrained.col(i));
    }
    EXPECT_LT(motion.weighted_sum(torque).norm(), 1e-7 * motion.weighted_sum(torque.cwiseAbs()).norm());
  }
  EXPECT_LT((motion.momentum() - momentum).norm(), 1e-10);
}

TEST_F(SpringSheetTest, EnergyNeverGrowsInFreeMotion) {
  const Sheet sheet = grid(PETSC_COMM_WORLD);
  for (const double stiffness : {10.0, 1e5}) {
    SpringOptions options;
    options.stiffness = stiffness;
    Moving motion(sheet, options);
    motion.stir(0.5);
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
std::map<PetscInt, Eigen::Vector3d> hang(const Sheet& sheet, TangentMatrix matrix) {
  std::vector<bool> pinned;
  for (const PetscInt id : sheet.persistent_id) {
    pinned.push_back(id == 70 || id == 79);
  }
  SpringOptions options;
  options.stiffness = 1000;
  options.newton_tolerance = 1e-7;
  options.mat_type = matrix;
  Moving motion(sheet, pinned, options);
  for (int n = 0; n < 10; ++n) {
    EXPECT_GT(motion.advance(0.01, {0, 0, -g}).linear_iterations, 0);
  }
  std::map<PetscInt, Eigen::Vector3d> result;
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    result[sheet.persistent_id[i]] = motion.positions.vector(i);
    if (pinned[i]) {
      EXPECT_EQ(motion.positions.vector(i), sheet.rest.col(i));
    }
  }
  return result;
}

TEST_F(SpringSheetTest, AnyNumberOfRanksAndAnySolverGiveTheSameSheet) {
  const std::map<PetscInt, Eigen::Vector3d> alone = hang(grid(PETSC_COMM_SELF), TangentMatrix::baij);
  EXPECT_LT(alone.at(4).z(), -0.02) << "it has fallen";
  const auto compare = [&alone](const char* what, TangentMatrix matrix = TangentMatrix::baij) {
    for (const auto& [id, position] : hang(grid(PETSC_COMM_WORLD), matrix)) {
      ASSERT_LT((position - alone.at(id)).norm(), 1e-9) << what << ", particle " << id;
    }
  };
  compare("pbjacobi");
  set("-spring_pc_type", "bjacobi");
  compare("bjacobi");
  set("-spring_ksp_type", "gmres");
  set("-spring_pc_type", "gamg");
  compare("gamg", TangentMatrix::aij);
  set("-spring_ksp_type", "preonly");
  set("-spring_pc_type", "lu");
  set("-spring_pc_factor_mat_solver_type", "mumps");
  compare("mumps", TangentMatrix::aij);
}

TEST_F(SpringSheetTest, SpringsWithoutLengthOrDirectionAreHarmless) {
  Sheet sheet = chain(3, 0, 0.1);
  Moving motion(sheet, SpringOptions());
  motion.advance(0.01, {0, 0, -g});
  for (PetscInt i = 0; i < sheet.particles.owned; ++i) {
    EXPECT_NEAR(motion.positions.vector(i).z(), -g * 1e-4, 1e-15);
  }
}

/// A step of 0.1 s of a sheet that is stretched at its start.
ImplicitResult step_of(const Sheet& sheet, double stretch) {
  Field start(sheet.particles, 3);
  Field positions(sheet.particles, 3);
  start.values() = sheet.rest;
  positions.values() = stretch * sheet.rest;
  const std::vector<bool> pinned(sheet.particles.local(), false);
  const std::vector<double> ones(pinned.size(), 1);
  const SpringOptions options;
  BalancedStep<SpringSheet> springs(options, sheet, options, pinned, 0.1, std::vector<Potential*>());
  return springs.advance(positions,
                         {{sheet.initial_mass, start, 0.1}, initial_lengths(sheet), ones, ones, ActiveSet(sheet)});
}

TEST_F(SpringSheetTest, AnAbsoluteToleranceThatMovesNothingIsAFailedSolve) {
  const Sheet sheet = grid(PETSC_COMM_WORLD);
  set("-spring_ksp_atol", "1e20");
  const ImplicitResult result = step_of(sheet, 1.2);
  EXPECT_FALSE(result.converged);
  EXPECT_EQ(result.reason.find("the linear solver spring_ (cg) does not solve: it leaves 1.0e+00 of"), 0U)
      << result.reason;
  set("-spring_ksp_atol", "1e-12");
  EXPECT_TRUE(step_of(sheet, 1.2).converged);
  EXPECT_TRUE(step_of(sheet, 1 + 1e-12).converged) << "and where there is nothing to solve";
}

TEST_F(SpringSheetTest, FailedSolveIsAResult) {
  set("-spring_ksp_max_it", "1");
  const ImplicitResult result = step_of(grid(PETSC_COMM_WORLD), 1.2);
  EXPECT_FALSE(result.converged);
  EXPECT_EQ(result.reason, "the linear solver spring_ did not converge (DIVERGED_ITS after 1 iterations)");
}

/// Ends by undeformed position of a step of a sheet of which only what is at y < 0.35 m is there.
std::map<std::array<int, 3>, Eigen::Vector3d> ends_of_active(const Sheet& sheet) {
  SpringOptions options;
  options.newton_tolerance = 1e-9;
  options.max_iterations = 100;
  options.damping = 0.01;
  const auto is_there = [&](PetscInt i) { return sheet.rest(1, i) < 0.35; };
  std::vector<double> mass = sheet.initial_mass;
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    mass[i] = is_there(i) ? 0.01 : 0;
  }
  ActiveSet active(sheet);
  for (const Colour colour : all_colours) {
    const auto index = static_cast<std::size_t>(colour);
    for (std::size_t s = 0; s < active.springs[index].size(); ++s) {
      const auto [a, b] = sheet.of(colour).ends[s];
      active.springs[index][s] = is_there(a) && is_there(b);
    }
  }
  const std::vector<bool> pinned(sheet.particles.local(), false);
  const std::vector<double> ones(pinned.size(), 1);
  Field start(sheet.particles, 3);
  Field x(sheet.particles, 3);
  start.values() = x.values() = sheet.rest;
  x.values().topRows(1) *= 1.1;
  BalancedStep<SpringSheet> springs(options, sheet, options, pinned, 0.01, std::vector<Potential*>());
  const ImplicitResult result = springs.advance(x, {{mass, start, 0.01}, initial_lengths(sheet), ones, ones, active});
  EXPECT_TRUE(result.converged) << result.reason;
  std::map<std::array<int, 3>, Eigen::Vector3d> ends;
  for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
    if (is_there(i)) {
      const Eigen::Vector3i place = (1e4 * sheet.rest.col(i)).array().round().matrix().cast<int>();
      ends[{place[0], place[1], place[2]}] = x.vector(i);
    }
  }
  return ends;
}

TEST_F(SpringSheetTest, WhatHasDiedMovesNothing) {
  SheetOptions options;
  options.thickness = 0.03;
  const auto part = ends_of_active(make_sheet(PETSC_COMM_SELF, grid_mesh(9, 4, 0.1), options));
  for (const auto& [place, end] : ends_of_active(make_sheet(PETSC_COMM_WORLD, grid_mesh(9, 7, 0.1), options))) {
    ASSERT_LT((end - part.at(place)).norm(), 1e-9);
  }
}

}  // namespace
}  // namespace pellicle::spring_sheet_test
