// A step of a sheet that changes no topology allocates nothing, makes no object of PETSc's, and so has no symbolic
// work, and looks up no option. What is made at first, in the first steps, does not count.
//
// Look-ups of PETSc's own stay: KSPSolve asks for -ksp_converged_reason, MatAssemblyEnd for -mat_view, SNES for
// -snes_test_jacobian and others in each Jacobian, and all of them act. On several ranks PetscSF compares MPI's types
// at every exchange, for which it allocates: not counted there. Nor do allocations count that libraries make when they
// factorise, and solve with the factors: the coarse matrix of rigid patches (CHOLMOD allocates in every solve).

#include <gtest/gtest.h>
#include <petscksp.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/handle.h"
#include "surface/shell.h"
#include "tests/allocations/allocation_counter.h"
#include "tests/support/alone.h"
#include "tests/support/grid_mesh.h"
#include "world/burn.h"

namespace pellicle {
namespace {

int ranks() {
  int count = 1;
  MPI_Comm_size(PETSC_COMM_WORLD, &count);
  return count;
}

TEST(Allocations, AreCounted) {
  const auto count = [](const std::function<void()>& work) {
    const Requests before = requests();
    work();
    return requests() - before;
  };
  std::vector<double> standard;
  EXPECT_EQ(count([&] { standard.resize(1000); }).own, 1);
  Eigen::VectorXd eigen;
  EXPECT_EQ(count([&] { eigen.resize(1000); }).own, 1);
  EXPECT_EQ(count([&] { eigen.setZero(1000); }).own, 0);
  double* foreign = nullptr;
  EXPECT_EQ(count([&] { check(PetscMalloc1(1000, &foreign)); }).foreign, 1);
  check(PetscFree(foreign));
  PetscBool is_set = PETSC_FALSE;
  EXPECT_EQ(count([&] { check(PetscOptionsHasName(nullptr, nullptr, "-unknown", &is_set)); }).option_lookups, 1);
  Handle<KSP, KSPDestroy> ksp;
  EXPECT_EQ(count([&] { check(KSPCreate(PETSC_COMM_SELF, ksp.create())); }).objects, 1);
  EXPECT_GT(count([&] { check(KSPSetFromOptions(ksp)); }).option_lookups, 10);
}

/// A sheet that hangs by two corners and is heated.
struct Case {
  std::string name;
  std::function<void(Options&)> set;
  bool is_balanced = false;  ///< whether SNES solves for the motion, which looks up and copies options in each Jacobian
  bool has_factors = false;  ///< whether a library factorises in the stage that moves the sheet
};

class AllocationsOfAStep : public ::testing::TestWithParam<Case> {};

TEST_P(AllocationsOfAStep, AreNone) {
  Options options;
  GetParam().set(options);
  options.sheet.thickness = 0.02;
  options.sheet.is_one_surface = options.dynamics == Dynamics::elastic;
  options.sheet.perturbation = 0.01;
  options.pins["hooks"].vertices = {0, 1};
  HeatSource ball;
  ball.radius = 0.3;
  options.heat.sources["ball"] = ball;
  options.combustion.ignition_temperature = 350;  // It burns, but nothing is burnt through.
  const Sheet sheet = make_sheet(PETSC_COMM_WORLD, grid_mesh(30, 20, 0.05), options.sheet);
  StageClock clock(Burn::stage_names());
  Burn burn(sheet, options, clock);
  State state = burn.initial_state();
  burn.follow(state);
  Alone<Burn> alone(burn);
  constexpr double h = 2e-3;  // [s]
  for (int step = 0; step < 3; ++step) {
    ASSERT_TRUE(alone.advance(state, h).converged);
  }
  const auto expect_none = [](const std::string& stage, const std::function<bool()>& run, bool is_balanced = false,
                              bool has_factors = false) {
    const Requests before = requests();
    const bool converged = run();
    const Requests found = requests() - before;
    EXPECT_TRUE(converged) << stage;
    EXPECT_EQ(found.own, 0) << stage;
    EXPECT_EQ(found.objects, 0) << stage;
    if (!has_factors && !is_balanced) {
      EXPECT_EQ(ranks() == 1 ? found.foreign : 0, 0) << stage;
    }
    if (!is_balanced) {
      EXPECT_EQ(found.option_lookups, 0) << stage;
    }
  };
  for (int step = 0; step < 3; ++step) {
    expect_none("heat", [&] {
      const StageResult heated = burn.heat(state, h);
      return heated.converged && heated.iterations > 0;
    });
    expect_none("combustion", [&] {
      burn.combustion(state, h);
      return true;
    });
    expect_none("ablation", [&] { return !burn.ablation(state, h); });
    expect_none(
        "dynamics",
        [&] {
          if (!burn.begin_dynamics(state, h).converged) {
            return false;
          }
          const DynamicsResult moved = burn.end_dynamics(state, alone.solve(h));
          return moved.converged && moved.iterations > 0;
        },
        GetParam().is_balanced, GetParam().has_factors);
    expect_none("end of the step", [&] { return burn.end_step(state, h).converged; });
  }
}

INSTANTIATE_TEST_SUITE_P(
    Sheets, AllocationsOfAStep,
    ::testing::Values(Case{"elastic", [](Options& options) { options.dynamics = Dynamics::elastic; }, true},
                      Case{"stiff_elastic",
                           [](Options& options) {
                             options.dynamics = Dynamics::elastic;
                             options.material.tensile_stiffness = 3e5;
                           },
                           true, true},
                      Case{"projection", [](Options& options) { options.dynamics = Dynamics::projection; }},
                      Case{"joint_projection",
                           [](Options& options) {
                             options.dynamics = Dynamics::projection;
                             options.project.method = ProjectMethod::joint;
                             options.project.max_steps = 1;
                           }},
                      Case{"umbrella",
                           [](Options& options) {
                             options.dynamics = Dynamics::projection;
                             options.heat.operator_name = HeatOperator::umbrella;
                           }},
                      Case{"assembled_heat",
                           [](Options& options) {
                             options.dynamics = Dynamics::projection;
                             options.heat.mat_type = HeatMatrix::aij;
                           }}),
    [](const auto& instance) { return instance.param.name; });

}  // namespace
}  // namespace pellicle
