// A step of a sheet that changes no topology allocates nothing, makes no object of PETSc's, and so has no symbolic
// work, and looks up no option. What is made at first, in the first steps, does not count.
//
// Look-ups of PETSc's own stay: KSPSolve asks for -ksp_converged_reason, MatAssemblyEnd for -mat_view, SNES for
// -snes_test_jacobian and others in each Jacobian, and all of them act. On several ranks PetscSF compares MPI's types
// at every exchange, for which it allocates: not counted there. Nor do allocations count that libraries make when they
// factorise, and solve with the factors: the coarse matrix of rigid patches (CHOLMOD allocates in every solve).

#include <gtest/gtest.h>
#include <petscksp.h>

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/handle.h"
#include "equilibrium/equilibrium.h"
#include "tests/allocations/allocation_counter.h"
#include "tests/support/grid_mesh.h"
#include "world/chain.h"
#include "world/group.h"

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
  options.sheet.perturbation = 0.01;
  options.pins["hooks"].vertices = {0, 1};
  HeatSource ball;
  ball.radius = 0.3;
  options.heat.sources["ball"] = ball;
  options.combustion.ignition_temperature = 350;  // It burns, but nothing is burnt through.
  const std::unique_ptr<Chain> chain = make_chain(options);
  const std::shared_ptr<const Surface> sheet =
      chain->make_surface(PETSC_COMM_WORLD, rows_of(PETSC_COMM_WORLD, grid_mesh(30, 20, 0.05)));
  const std::unique_ptr<State> state = chain->initial_state(*sheet);
  StageClock clock(chain->words.clock_names);
  Textures textures(PETSC_COMM_WORLD);
  const Stages stages = chain->make_stages(*sheet, *state, clock, textures);
  for (const std::unique_ptr<Stage>& stage : stages.all) {
    stage->start();
  }
  for (const std::unique_ptr<Stage>& stage : stages.all) {
    stage->update_derived();
  }
  MotionStage& motion = *stages.motion;
  const GroupPlan plan = plan_of(options);
  Equilibrium equilibrium({{"", &motion, plan.contact.self}}, plan.contact, plan.newton, clock, motion.stage());
  const std::array<std::string, 7> names{"heat",   "combustion", "shrinkage",   "ablation",
                                         "motion", "strain",     "heat balance"};
  ASSERT_EQ(stages.all.size(), names.size());
  bool is_counted = false;
  const auto expect_none = [&](const std::string& stage, const std::function<bool()>& run, bool moves) {
    const Requests before = requests();
    const bool converged = run();
    const Requests found = requests() - before;
    EXPECT_TRUE(converged) << stage;
    if (!is_counted) {
      return;
    }
    const bool is_balanced = moves && GetParam().is_balanced;
    const bool has_factors = moves && GetParam().has_factors;
    EXPECT_EQ(found.own, 0) << stage;
    EXPECT_EQ(found.objects, 0) << stage;
    if (!has_factors && !is_balanced) {
      EXPECT_EQ(ranks() == 1 ? found.foreign : 0, 0) << stage;
    }
    if (!is_balanced) {
      EXPECT_EQ(found.option_lookups, 0) << stage;
    }
  };
  for (int n = 0; n < 6 && !HasFailure(); ++n) {
    is_counted = n >= 3;
    Step step;
    step.h = 2e-3;
    const auto expect_none_of_all = [&](const std::string& what, StageResult (Stage::*part)(Step&)) {
      for (std::size_t i = 0; i < names.size(); ++i) {
        Stage& stage = *stages.all[i];
        expect_none(
            names[i] + what, [&] { return (stage.*part)(step).converged; }, &stage == &motion);
      }
    };
    expect_none_of_all(" at the beginning", &Stage::begin);
    expect_none(
        "balance",
        [&] {
          step.balance = equilibrium.solve(step.h, state->factorised_steps);
          return step.balance.converged && motion.take_balance(step).converged;
        },
        true);
    expect_none_of_all(" at the end", &Stage::end);
    EXPECT_GT(step.heat_iterations, 0);
    EXPECT_GT(step.motion_iterations, 0);
    EXPECT_FALSE(step.has_burnt);
    state->time += step.h;
    ++state->step;
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
