#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "heat/heat_balance.h"
#include "tests/support/alone.h"
#include "tests/support/by_id.h"
#include "tests/support/grid_mesh.h"
#include "tests/support/solver_options.h"
#include "tests/support/state_values.h"

namespace pellicle::burn_test {
namespace {

constexpr double edge = 0.1;
constexpr double step_length = 2e-3;

/// A sheet hung by two corners, a hot ball that sets it alight, a body that it falls on; tight inner tolerances.
Options burning_options(double width, double height) {
  Options options;
  options.dynamics = Dynamics::projection;
  options.sheet.thickness = 0.05;
  options.sheet.perturbation = 0.01;
  options.force.gravity = {0, 0, -1};
  HeatSource ball;
  ball.centre = {0.1, 0.1, 0};
  ball.velocity = {1, 0.5, 0};
  ball.radius = 0.3;
  ball.rate = 200;
  options.heat.sources["ball"] = ball;
  options.heat.ksp_rtol = 1e-14;
  options.combustion.mass_loss_rate = 0.05;
  options.project.ksp_rtol = 1e-13;
  options.project.max_steps = 3;
  options.project.weight.fill(0.5);
  options.pins["hooks"].vertices = {0, 1};
  BodyOptions body;
  body.centre = {width / 2, height / 2, -0.214};
  body.radius = 0.2;
  body.velocity = {0, 0, 1};
  options.bodies["body"] = body;
  return options;
}

/// A sheet that steps by itself.
struct BurningSheet : Alone {
  BurningSheet(const SurfaceMesh& mesh, Options options, MPI_Comm comm = PETSC_COMM_WORLD)
      : Alone(mesh, std::move(options), ChainKind::burn, comm) {}

  void go(int steps) {
    for (int step = 0; step < steps; ++step) {
      const AloneStep result = advance(step_length);
      ASSERT_TRUE(result.converged) << "step " << step + 1 << ": " << result.reason;
    }
  }

  double dead_triangles() const {
    const auto& triangles = burning().active.triangles;
    return total(
        static_cast<double>(std::count(triangles.begin(), triangles.begin() + 4 * surface().elements.owned, false)));
  }

  double total(double value) const {
    MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_DOUBLE, MPI_SUM, surface().comm());
    return value;
  }
};

TEST(Burn, MassLeftAndMassBurntAreTheInitialMass) {
  BurningSheet sheet(grid_mesh(8, 6, edge), burning_options(0.8, 0.6));
  const double initial = 0.08 * 0.8 * 0.6;  // areal density times area
  for (int step = 0; step < 30; ++step) {
    sheet.go(1);
    const double left = sheet.total(sheet.burning().mass.values().leftCols(sheet.surface().particles.owned).sum());
    const double burnt = sheet.total(sheet.burning().mass_burnt);
    ASSERT_NEAR(left + burnt, initial, 1e-12 * initial) << "step " << step + 1;
  }
  EXPECT_GT(sheet.total(sheet.burning().mass_burnt), 0.01 * initial);
}

TEST(Burn, LengthsAndMassesStayWhenNothingBurns) {
  Options options = burning_options(0.8, 0.6);
  options.combustion.ignition_temperature = 2000;  // hotter than the ball
  BurningSheet sheet(grid_mesh(8, 6, edge), options);
  sheet.go(5);
  for (const Colour colour : all_colours) {
    EXPECT_EQ(sheet.state().target_length[static_cast<std::size_t>(colour)], sheet.sheet().of(colour).initial_length);
  }
  for (PetscInt i = 0; i < sheet.surface().particles.local(); ++i) {
    EXPECT_EQ(sheet.burning().mass.data()[i], sheet.surface().initial_mass[i]);
  }
  EXPECT_EQ(sheet.burning().mass_burnt, 0);
  EXPECT_EQ(sheet.state().step, 5);
  EXPECT_DOUBLE_EQ(sheet.state().time, 5 * step_length);
}

TEST(Burn, UniformBurningShrinksAllLengthsAlike) {
  Options options = burning_options(0.8, 0.6);
  options.heat.sources.clear();
  options.heat.initial_temperature = 700;
  options.heat.burning_heat = 0;
  BurningSheet sheet(grid_mesh(8, 6, edge), options);
  sheet.go(3);
  // Eq. 4: dm/m^init = -mu h (T - T^ignition) a step, eq. 5 with the density that falls linearly to the burnt one.
  const double mass = 1 - 3 * 0.05 * step_length * 200;
  const double density = 1 - (1 - 320.0 / 800.0) * (1 - mass) / (1 - 0.3);
  for (const Colour colour : all_colours) {
    const SpringSet& springs = sheet.sheet().of(colour);
    for (std::size_t s = 0; s < springs.ends.size(); ++s) {
      EXPECT_NEAR(sheet.state().target_length[static_cast<std::size_t>(colour)][s] / springs.initial_length[s],
                  mass / density, 1e-12);
    }
  }
}

TEST(Burn, ACornerThatHasLeftFallsWithTheRestOfItsQuad) {
  for (const Dynamics dynamics : {Dynamics::projection, Dynamics::spring, Dynamics::elastic}) {
    Options options;
    options.dynamics = dynamics;
    options.sheet.thickness = 0.05;
    options.force.gravity = {0, 0, -10};
    options.contact.self = true;
    options.force.damping = 0;
    options.heat.initial_temperature = 0;  // so that mass that is taken away takes no heat
    options.ablation.loss_mass = 0.5;
    options.combustion.burnt_density =
        options.combustion.min_mass * options.combustion.initial_density;  // no shrinkage
    BurningSheet sheet(grid_mesh(3, 3, edge), options);
    for (PetscInt i = 0; i < sheet.surface().particles.local(); ++i) {  // all of one quad but the corner in the middle
      const PetscInt id = sheet.surface().persistent_id[i];
      if (id == 0 || id == 1 || id == 4 || id == 16) {
        sheet.state().burning->mass.data()[i] *= 0.4;
      }
    }
    sheet.go(100);
    EXPECT_EQ(sheet.dead_triangles(), 2);
    const Eigen::MatrixXd masses = by_id(sheet.surface(), sheet.burning().mass);
    const Eigen::MatrixXd places = by_id(sheet.surface(), sheet.state().position);
    EXPECT_EQ(masses(0, 0), 0);
    const double fall = -places(2, 5);
    EXPECT_NEAR(fall, 0.202, 0.02);  // 10 m/s^2 times 100 101/2 steps squared
    EXPECT_NEAR(-places(2, 0), fall, 0.1 * fall);
  }
}

TEST(Burn, NothingSlowsTheFallOfAnElasticSheetUnlessAsked) {
  Options options;
  options.sheet.perturbation = 0;
  BurningSheet sheet(irregular_mesh(8, 6, edge), options);
  const double g = options.force.gravity.norm();
  const int steps = 100;
  for (int step = 0; step < steps; ++step) {
    ASSERT_TRUE(sheet.advance(step_length).converged);
  }
  const double speed = steps * step_length * g;
  const double depth = step_length * step_length * g * steps * (steps + 1) / 2;
  const Eigen::MatrixXd moved = sheet.state().position.values() - sheet.surface().rest;
  for (PetscInt i = 0; i < sheet.surface().particles.local(); ++i) {
    EXPECT_LE((moved.col(i) - Eigen::Vector3d(0, 0, -depth)).norm(), 1e-10 * depth);
    EXPECT_LE((sheet.state().velocity.vector(i) - Eigen::Vector3d(0, 0, -speed)).norm(), 1e-10 * speed);
  }
  EXPECT_GT(options.material.damping, 0) << "what deforms is damped";
  EXPECT_EQ(velocity_damping(options), 0);
  options.dynamics = Dynamics::projection;
  EXPECT_EQ(velocity_damping(options), 2);
  options.dynamics = Dynamics::elastic;
  options.force.damping = 3;
  EXPECT_EQ(velocity_damping(options), 3);
}

TEST(Burn, FreeSheetFallsLikeAStone) {
  Options options = burning_options(0.8, 0.6);
  options.pins.clear();
  options.bodies.clear();
  options.heat.sources.clear();
  options.sheet.perturbation = 0;
  options.force.damping = 3;
  BurningSheet sheet(grid_mesh(8, 6, edge), options);
  const int steps = 10;
  sheet.go(steps);
  double speed = 0;  // eq. 8 and 9
  double depth = 0;
  for (int step = 0; step < steps; ++step) {  // dv/dt = g - 3 v
    speed = 1.0 / 3 + (speed - 1.0 / 3) * std::exp(-3 * step_length);
    depth += step_length * speed;
  }
  const Eigen::MatrixXd moved = sheet.state().position.values() - sheet.surface().rest;
  for (PetscInt i = 0; i < sheet.surface().particles.local(); ++i) {
    EXPECT_LE((moved.col(i) - Eigen::Vector3d(0, 0, -depth)).norm(), 1e-12);
    EXPECT_LE((sheet.state().velocity.vector(i) - Eigen::Vector3d(0, 0, -speed)).norm(), 1e-10);
  }
}

TEST(Burn, BodiesHoldTheSheetWhateverKeepsItsLengths) {
  if (ranks() > 2) {
    GTEST_SKIP() << "on one and two ranks only";
  }
  for (const char* dynamics : {"projection", "spring", "elastic"}) {
    Options options = burning_options(0.8, 0.6);
    options.pins.clear();
    options.bodies.clear();
    options.heat.sources.clear();
    options.dynamics = dynamics;
    options.bodies["floor"].shape = "plane";
    options.bodies["floor"].point = {0, 0, -0.02};
    options.bodies["floor"].velocity = {0, 0, 1};
    BurningSheet sheet(grid_mesh(8, 6, edge), options);
    double contacts = 0;
    for (int step = 0; step < 20; ++step) {
      const AloneStep result = sheet.advance(step_length);
      ASSERT_TRUE(result.converged) << result.reason;
      const double floor = sheet.state().time - 0.02;
      // A sheet with stiffness is pressed from the contact's thickness on, a tenth of an edge.
      const bool is_elastic = options.dynamics != Dynamics::projection;
      const double reach = floor + (is_elastic ? 0.1 * edge : 1e-12);
      double touching = 0;
      for (PetscInt i = 0; i < sheet.surface().particles.owned; ++i) {
        const double z = sheet.state().position.vector(i).z();
        EXPECT_GE(z, floor - 1e-12) << dynamics << " step " << step;
        touching += z < reach ? 1 : 0;
        if (z < reach && !is_elastic) {
          EXPECT_GE(sheet.state().velocity.vector(i).z(), 1 - 1e-9) << dynamics << ": it does not fall into the floor";
        }
      }
      EXPECT_EQ(static_cast<double>(result.contacts), touching) << dynamics << " step " << step;
      contacts += sheet.total(touching);
    }
    EXPECT_GT(contacts, 0) << dynamics;
  }
}

TEST(Burn, PinnedParticlesAreWhereTheirPinsAreAtTheEndOfTheStep) {
  if (ranks() > 2) {
    GTEST_SKIP() << "on one and two ranks only";
  }
  Options options = burning_options(0.8, 0.6);
  options.pins["hooks"].path = {{0, 0, 0, 0}, {step_length, 0, 0, 0.001}, {3 * step_length, 0.004, 0, 0}};
  options.pins["rail"].vertices = {62};
  options.pins["rail"].velocity = {0, 0.5, -0.25};
  const std::vector<Eigen::Vector3d> path{{0, 0, 0.001}, {0.002, 0, 0.0005}, {0.004, 0, 0}};
  for (const char* dynamics : {"projection", "spring", "elastic"}) {
    options.dynamics = dynamics;
    BurningSheet sheet(grid_mesh(8, 6, edge), options);
    Eigen::Vector3d before(0, 0, 0);
    for (const Eigen::Vector3d& place : path) {
      sheet.go(1);
      for (PetscInt i = 0; i < sheet.surface().particles.local(); ++i) {
        const PetscInt id = sheet.surface().persistent_id[i];
        const Eigen::Vector3d rail(0, 0.5, -0.25);
        const Eigen::Vector3d moved = id == 62 ? Eigen::Vector3d(sheet.state().time * rail) : place;
        const Eigen::Vector3d velocity = id == 62 ? rail : Eigen::Vector3d((place - before) / step_length);
        if (id == 0 || id == 1 || id == 62) {
          EXPECT_LE((sheet.state().position.vector(i) - sheet.surface().rest.col(i) - moved).norm(), 1e-14) << id;
          EXPECT_LE((sheet.state().velocity.vector(i) - velocity).norm(), 1e-10) << id;
        }
      }
      before = place;
    }
  }
}

// The projection conserves momentum: it changes only by what the lost mass carries away.
TEST(Burn, MomentumOfAFreeSheetLeavesWithItsMassAlone) {
  if (ranks() > 2) {
    GTEST_SKIP() << "on one and two ranks only";
  }
  const auto drift = [](const std::string& masses) {
    Options options = burning_options(0.8, 0.6);
    options.pins.clear();
    options.bodies.clear();
    options.force.gravity.setZero();
    options.force.damping = 0;
    options.combustion.mass_loss_rate = 0.5;
    options.ablation.loss_mass = 0.6;
    if (!masses.empty()) {
      options.project.masses = masses;
    }
    BurningSheet sheet(irregular_mesh(8, 6, edge), options);
    sheet.state().velocity.values().row(2) = 3 * sheet.surface().rest.row(0);  // It turns.
    const auto momentum = [&sheet](const Eigen::MatrixXd& mass, const Eigen::MatrixXd& velocity) {
      const PetscInt owned = sheet.surface().particles.owned;
      Eigen::Vector3d sum = velocity.leftCols(owned) * mass.leftCols(owned).transpose();
      MPI_Allreduce(MPI_IN_PLACE, sum.data(), 3, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
      return sum;
    };
    Eigen::Vector3d expected = momentum(sheet.burning().mass.values(), sheet.state().velocity.values());
    const double initial_mass = sheet.burning().mass.values().sum();
    for (int step = 0; step < 30; ++step) {
      const Eigen::MatrixXd mass = sheet.burning().mass.values();
      const Eigen::MatrixXd velocity = sheet.state().velocity.values();
      sheet.go(1);
      expected += momentum(sheet.burning().mass.values() - mass, velocity);
    }
    EXPECT_LT(sheet.burning().mass.values().sum(), 0.95 * initial_mass) << "too little burnt";
    return (momentum(sheet.burning().mass.values(), sheet.state().velocity.values()) - expected).norm() /
           expected.norm();
  };
  EXPECT_LT(drift(""), 1e-12) << "by default";
  EXPECT_GT(drift("equal"), 1e-4) << "the paper's";
}

// The heat ledger.

/// What a rank's state has, summed over the ranks.
struct HeatLedger {
  explicit HeatLedger(const BurningSheet& sheet)
      : content(sheet.total(heat_content(sheet.surface(), sheet.burning().mass, sheet.burning().temperature,
                                         sheet.object.options().heat.capacity))),
        in(sheet.total(sheet.burning().heat_in)),
        out(sheet.total(sheet.burning().heat_out)),
        made(sheet.total(sheet.burning().heat_made)) {}
  double content, in, out, made;
};

struct HeatCase {
  std::string name;
  std::function<void(Options&)> change;
  double step = step_length;
};

std::vector<HeatCase> heat_cases() {
  return {{"as_it_is", [](Options&) {}},
          {"loose_solver", [](Options& o) { o.heat.ksp_rtol = 0.01; }},
          {"no_conduction", [](Options& o) { o.heat.diffusivity = 0; }},
          {"hardly_any_conduction", [](Options& o) { o.heat.diffusivity = 1e-12; }},
          {"huge_conduction", [](Options& o) { o.heat.diffusivity = 1e6; }},
          {"long_steps", [](Options&) {}, 10 * step_length},
          {"short_steps", [](Options&) {}, step_length / 64},
          {"into_the_cold",
           [](Options& o) {
             o.heat.emissivity = 1;
             o.heat.convection = 300;
             o.heat.ambient_temperature = 0;
           }},
          {"into_the_heat",
           [](Options& o) {
             o.heat.emissivity = 1;
             o.heat.convection = 300;
             o.heat.ambient_temperature = 1500;
           }},
          {"several_sources",
           [](Options& o) {
             o.heat.sources["cold"] = o.heat.sources.at("ball");
             o.heat.sources["cold"].temperature = 100;
             o.heat.sources["hot"] = o.heat.sources.at("ball");
             o.heat.sources["hot"].temperature = 3000;
             o.heat.sources["hot"].end_time = 0.02;
           }},
          {"burns_away",
           [](Options& o) {
             o.combustion.mass_loss_rate = 2;
             o.ablation.loss_mass = 0.9;
             o.combustion.min_mass = 0.8;
           }},
          {"tears", [](Options& o) {
             o.ablation.strength = 5;
             o.combustion.mass_loss_rate = 0.2;
           }}};
}

TEST(Burn, HeatLedgerClosesWhateverTheScene) {
  if (ranks() > 2) {
    GTEST_SKIP() << "on one and two ranks only";
  }
  for (const HeatCase& c : heat_cases()) {
    Options options = burning_options(0.8, 0.6);
    options.heat.ksp_rtol = HeatOptions{}.ksp_rtol;
    options.project.ksp_rtol = 1e-2;
    options.project.max_steps = 1;
    c.change(options);
    BurningSheet sheet(irregular_mesh(6, 5, edge), options);
    const double initial = HeatLedger(sheet).content;
    double worst = 0;
    for (int step = 0; step < 12; ++step) {
      const AloneStep result = sheet.advance(c.step);
      ASSERT_TRUE(result.converged) << c.name << ": " << result.reason;
      const HeatLedger now(sheet);
      worst = std::max(worst, std::abs(now.content - initial - now.in + now.out) / now.in);
    }
    const HeatLedger end(sheet);
    EXPECT_GT(end.in, 1) << c.name;
    EXPECT_LE(worst, 1e-9) << c.name;
    EXPECT_LE(std::abs(end.made), 1e-9 * end.in) << c.name;
    if (c.name == "burns_away") {
      EXPECT_GT(sheet.dead_triangles(), 0) << c.name;
    } else if (c.name == "tears") {
      EXPECT_GT(sheet.total(sheet.burning().cracked_sides), 0) << c.name;
    }
  }
}

TEST(Burn, WhatTheUmbrellaMakesIsInTheLedger) {
  if (ranks() > 2) {
    GTEST_SKIP() << "on one and two ranks only";
  }
  Options options = burning_options(0.8, 0.6);
  options.heat.operator_name = "umbrella";
  options.heat.diffusivity = 0.1;
  BurningSheet sheet(irregular_mesh(8, 6, edge), options);
  const double initial = HeatLedger(sheet).content;
  sheet.go(20);
  const HeatLedger end(sheet);
  EXPECT_GT(std::abs(end.made), 1e-3 * end.in);
  EXPECT_NEAR(end.content, initial + end.in - end.out + end.made, 1e-9 * end.in);
}

TEST(Burn, StepWhoseHeatLedgerIsOpenFails) {
  if (ranks() > 2) {
    GTEST_SKIP() << "on one and two ranks only";
  }
  for (const char* name : {"consistent", "umbrella"}) {
    Options options = burning_options(0.8, 0.6);
    options.heat.operator_name = name;
    BurningSheet sheet(grid_mesh(8, 6, edge), options);
    sheet.go(2);
    sheet.burning().heat_out += 1e-6 * sheet.burning().heat_in + 1e-9;
    const AloneStep step = sheet.advance(step_length);
    EXPECT_FALSE(step.converged) << name;
    EXPECT_EQ(step.reason.find("the heat ledger does not close: "), 0U) << step.reason;
    EXPECT_EQ(sheet.state().step, 2);
  }
}

// Failed steps.

/// Burns so fast that a projection fails.
Options absurd_options() {
  Options options = burning_options(0.8, 0.6);
  options.combustion.mass_loss_rate = 2;
  options.project.error_limit = 0.05;
  return options;
}

TEST(Burn, StepThatFailsSaysWhy) {
  BurningSheet sheet(grid_mesh(8, 6, edge), absurd_options());
  AloneStep step;
  for (int k = 0; k < 20 && step.converged; ++k) {
    step = sheet.advance(step_length);
  }
  EXPECT_FALSE(step.converged);
  EXPECT_NE(step.reason.find("project.error_limit"), std::string::npos) << step.reason;
}

TEST(Burn, FailedLinearSolvesFailTheStep) {
  for (const char* prefix : {"project_yellow_", "heat_"}) {
    SolverOptions solver;
    solver.set(std::string(prefix) + "ksp_max_it", "1");
    BurningSheet sheet(grid_mesh(8, 6, edge), burning_options(0.8, 0.6));
    const AloneStep step = sheet.advance(step_length);
    EXPECT_FALSE(step.converged);
    EXPECT_NE(step.reason.find(prefix), std::string::npos) << step.reason;
    EXPECT_EQ(sheet.state().step, 0);
  }
}

TEST(Burn, AFailedStepLeavesNoTrace) {
  BurningSheet sheet(grid_mesh(8, 6, edge), absurd_options());
  BurningSheet untouched(grid_mesh(8, 6, edge), absurd_options());
  int accepted = 0;
  while (true) {
    sheet.object.keep();
    if (!sheet.advance(step_length).converged) {
      sheet.object.restore();
      break;
    }
    ASSERT_LT(++accepted, 20);
  }
  ASSERT_GT(accepted, 0);
  untouched.go(accepted);
  EXPECT_EQ(values_of(sheet.state()), values_of(untouched.state()));
  // Nor does the failure leave a trace elsewhere: a shorter step goes as if nothing had happened.
  const double shorter = step_length / 64;
  EXPECT_EQ(sheet.advance(shorter).converged, untouched.advance(shorter).converged);
  EXPECT_EQ(values_of(sheet.state()), values_of(untouched.state()));
}

// Ranks.

struct Fields {
  explicit Fields(const BurningSheet& sheet)
      : all{by_id(sheet.surface(), sheet.state().position), by_id(sheet.surface(), sheet.state().velocity),
            by_id(sheet.surface(), sheet.burning().temperature), by_id(sheet.surface(), sheet.burning().mass)} {}
  std::array<Eigen::MatrixXd, 4> all;
};

void expect_close(const Fields& fields, const Fields& expected, double tolerance, const std::string& what) {
  constexpr std::array<const char*, 4> names{"position", "velocity", "temperature", "mass"};
  for (std::size_t f = 0; f < names.size(); ++f) {
    const double range = expected.all[f].maxCoeff() - expected.all[f].minCoeff();
    const double difference = (fields.all[f] - expected.all[f]).cwiseAbs().maxCoeff();
    EXPECT_LE(difference, tolerance * range) << what << ": " << names[f];
  }
}

Fields fields_after(MPI_Comm comm, const SurfaceMesh& mesh, const Options& options, int steps) {
  BurningSheet sheet(mesh, options, comm);
  sheet.go(steps);
  return Fields(sheet);
}

TEST(BurnOnRanks, AgreeWithOneRankWhateverThePartitioner) {
  const SurfaceMesh mesh = grid_mesh(8, 6, edge);
  Options options = burning_options(0.8, 0.6);
  const Fields alone = fields_after(PETSC_COMM_SELF, mesh, options, 20);
  EXPECT_LT(alone.all[3].minCoeff(), 0.9 * 0.08 * edge * edge / 8) << "nothing burnt";
  for (const char* partitioner : {"metis", "ptscotch", "simple"}) {
    options.sheet.partitioner = partitioner;
    expect_close(fields_after(PETSC_COMM_WORLD, mesh, options, 20), alone, 1e-9, partitioner);
  }
}

TEST(BurnOnRanks, AgreeWhateverTheMatrix) {
  const SurfaceMesh mesh = grid_mesh(8, 6, edge);
  Options options = burning_options(0.8, 0.6);
  options.project.mat_type = "aij";
  const Fields assembled = fields_after(PETSC_COMM_SELF, mesh, options, 20);
  for (const char* type : {"aij", "sell", "shell", "lines"}) {
    options.project.mat_type = type;
    options.heat.mat_type = std::string(type) == "shell" ? "shell" : "aij";
    expect_close(fields_after(PETSC_COMM_WORLD, mesh, options, 20), assembled, 1e-9, type);
  }
}

TEST(BurnOnRanks, AgreeWithARankThatHasNothing) {
  const SurfaceMesh mesh = grid_mesh(3, 1, edge);
  Options options = burning_options(0.3, 0.1);
  const Fields alone = fields_after(PETSC_COMM_SELF, mesh, options, 20);
  for (const char* type : {"aij", "sell", "shell", "lines"}) {
    options.project.mat_type = type;
    BurningSheet sheet(mesh, options);
    PetscInt least = sheet.surface().elements.owned;
    MPI_Allreduce(MPI_IN_PLACE, &least, 1, MPIU_INT, MPI_MIN, PETSC_COMM_WORLD);
    EXPECT_EQ(least == 0, ranks() > 3);
    sheet.go(20);
    expect_close(Fields(sheet), alone, 1e-9, type);
  }
}

}  // namespace
}  // namespace pellicle::burn_test
