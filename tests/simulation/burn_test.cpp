#include "simulation/burn.h"

#include <gtest/gtest.h>

#include <cmath>

#include "mesh/shell.h"
#include "tests/support/by_id.h"
#include "tests/support/grid_mesh.h"
#include "tests/support/solver_options.h"

namespace pellicle {
namespace {

constexpr double edge = 0.1;
constexpr double step_length = 2e-3;

/// A sheet hung by two corners, a hot ball that sets it alight, a body that it falls on; tight inner tolerances.
Options burning_options(double width, double height) {
  Options options;
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
  body.centre = {width / 2, height / 2, -0.21};
  body.radius = 0.2;
  body.velocity = {0, 0, 1};
  options.bodies["body"] = body;
  return options;
}

/// A sheet, its chain and its state.
struct Chain {
  Chain(MPI_Comm comm, const SurfaceMesh& mesh, Options given)
      : options(std::move(given)),
        sheet(make_sheet(comm, mesh, options.sheet)),
        clock(Burn::stage_names()),
        burn(sheet, options, clock),
        state(burn.initial_state()) {}

  void advance(int steps) {
    for (int step = 0; step < steps; ++step) {
      const BurnStep result = burn.advance(state, step_length);
      ASSERT_TRUE(result.converged) << "step " << step + 1 << ": " << result.reason;
    }
  }

  double total(double value) const {
    MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_DOUBLE, MPI_SUM, sheet.comm());
    return value;
  }

  Options options;
  Sheet sheet;
  StageClock clock;
  Burn burn;
  State state;
};

TEST(Burn, mass_left_and_mass_burnt_are_the_initial_mass) {
  Chain chain(PETSC_COMM_WORLD, grid_mesh(8, 6, edge), burning_options(0.8, 0.6));
  const double initial = 0.08 * 0.8 * 0.6;  // areal density times area
  for (int step = 0; step < 30; ++step) {
    chain.advance(1);
    const double left = chain.total(chain.state.mass.values().leftCols(chain.sheet.particles.owned).sum());
    const double burnt = chain.total(chain.state.mass_burnt);
    ASSERT_NEAR(left + burnt, initial, 1e-12 * initial) << "step " << step + 1;
  }
  EXPECT_GT(chain.total(chain.state.mass_burnt), 0.01 * initial);
}

TEST(Burn, lengths_and_masses_stay_when_nothing_burns) {
  Options options = burning_options(0.8, 0.6);
  options.combustion.ignition_temperature = 2000;  // hotter than the ball
  Chain chain(PETSC_COMM_WORLD, grid_mesh(8, 6, edge), options);
  chain.advance(5);
  for (const Colour colour : all_colours) {
    EXPECT_EQ(chain.state.target_length[static_cast<std::size_t>(colour)], chain.sheet.of(colour).initial_length);
  }
  for (PetscInt i = 0; i < chain.sheet.particles.local(); ++i) {
    EXPECT_EQ(chain.state.mass.data()[i], chain.sheet.initial_mass[static_cast<std::size_t>(i)]);
  }
  EXPECT_EQ(chain.state.mass_burnt, 0);
  EXPECT_EQ(chain.state.step, 5);
  EXPECT_DOUBLE_EQ(chain.state.time, 5 * step_length);
}

TEST(Burn, uniform_burning_shrinks_all_lengths_alike) {
  Options options = burning_options(0.8, 0.6);
  options.heat.sources.clear();
  options.heat.initial_temperature = 700;
  options.heat.burning_heat = 0;
  Chain chain(PETSC_COMM_WORLD, grid_mesh(8, 6, edge), options);
  chain.advance(3);
  // Eq. 4: dm/m^init = -mu h (T - T^ignition) a step, eq. 5 with the density that falls linearly to the burnt one.
  const double mass = 1 - 3 * 0.05 * step_length * 200;
  const double density = 1 - (1 - 320.0 / 800.0) * (1 - mass) / (1 - 0.3);
  for (const Colour colour : all_colours) {
    const SpringSet& springs = chain.sheet.of(colour);
    for (std::size_t s = 0; s < springs.ends.size(); ++s) {
      EXPECT_NEAR(chain.state.target_length[static_cast<std::size_t>(colour)][s] / springs.initial_length[s],
                  mass / density, 1e-12);
    }
  }
}

TEST(Burn, free_sheet_falls_like_a_stone) {
  Options options = burning_options(0.8, 0.6);
  options.pins.clear();
  options.bodies.clear();
  options.heat.sources.clear();
  options.sheet.perturbation = 0;
  options.force.damping = 3;
  Chain chain(PETSC_COMM_WORLD, grid_mesh(8, 6, edge), options);
  const int steps = 10;
  chain.advance(steps);
  double speed = 0;  // eq. 8 and 9
  double depth = 0;
  for (int step = 0; step < steps; ++step) {
    speed = (speed + step_length) * std::exp(-3 * step_length);
    depth += step_length * speed;
  }
  const Eigen::MatrixXd moved = chain.state.position.values() - chain.sheet.rest;
  for (PetscInt i = 0; i < chain.sheet.particles.local(); ++i) {
    EXPECT_LE((moved.col(i) - Eigen::Vector3d(0, 0, -depth)).norm(), 1e-12);
    EXPECT_LE((chain.state.velocity.vector(i) - Eigen::Vector3d(0, 0, -speed)).norm(), 1e-10);
  }
}

// Failed steps.

void expect_same(const State& a, const State& b) {
  EXPECT_EQ(a.time, b.time);
  EXPECT_EQ(a.step, b.step);
  EXPECT_EQ(a.position.values(), b.position.values());
  EXPECT_EQ(a.velocity.values(), b.velocity.values());
  EXPECT_EQ(a.temperature.values(), b.temperature.values());
  EXPECT_EQ(a.mass.values(), b.mass.values());
  EXPECT_EQ(a.mass_change.values(), b.mass_change.values());
  EXPECT_EQ(a.target_length, b.target_length);
  EXPECT_EQ(a.mass_burnt, b.mass_burnt);
  EXPECT_EQ(a.heat_in, b.heat_in);
  EXPECT_EQ(a.heat_out, b.heat_out);
}

/// Burns so fast that a projection fails.
Options absurd_options() {
  Options options = burning_options(0.8, 0.6);
  options.combustion.mass_loss_rate = 2;
  options.project.error_limit = 0.05;
  return options;
}

TEST(Burn, step_that_fails_says_why) {
  Chain chain(PETSC_COMM_WORLD, grid_mesh(8, 6, edge), absurd_options());
  BurnStep step;
  for (int k = 0; k < 20 && step.converged; ++k) {
    step = chain.burn.advance(chain.state, step_length);
  }
  EXPECT_FALSE(step.converged);
  EXPECT_NE(step.reason.find("project.error_limit"), std::string::npos) << step.reason;
}

TEST(Burn, failed_linear_solves_fail_the_step) {
  for (const char* prefix : {"project_yellow_", "heat_"}) {
    SolverOptions solver;
    solver.set(std::string(prefix) + "ksp_max_it", "1");
    Chain chain(PETSC_COMM_WORLD, grid_mesh(8, 6, edge), burning_options(0.8, 0.6));
    const BurnStep step = chain.burn.advance(chain.state, step_length);
    EXPECT_FALSE(step.converged);
    EXPECT_NE(step.reason.find(prefix), std::string::npos) << step.reason;
    EXPECT_EQ(chain.state.step, 0);
  }
}

TEST(Burn, snapshot_puts_the_whole_state_back) {
  Chain chain(PETSC_COMM_WORLD, grid_mesh(8, 6, edge), absurd_options());
  Chain untouched(PETSC_COMM_WORLD, grid_mesh(8, 6, edge), absurd_options());
  int accepted = 0;
  while (true) {
    const Snapshot before(chain.state);
    if (!chain.burn.advance(chain.state, step_length).converged) {
      before.restore(chain.state);
      break;
    }
    ASSERT_LT(++accepted, 20);
  }
  ASSERT_GT(accepted, 0);
  untouched.advance(accepted);
  expect_same(chain.state, untouched.state);
  // Nor does the failure leave a trace elsewhere: a shorter step goes as if nothing had happened.
  const double shorter = step_length / 64;
  EXPECT_EQ(chain.burn.advance(chain.state, shorter).converged,
            untouched.burn.advance(untouched.state, shorter).converged);
  expect_same(chain.state, untouched.state);
}

// Ranks.

struct Fields {
  explicit Fields(const Chain& chain)
      : all{by_id(chain.sheet, chain.state.position), by_id(chain.sheet, chain.state.velocity),
            by_id(chain.sheet, chain.state.temperature), by_id(chain.sheet, chain.state.mass)} {}
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
  Chain chain(comm, mesh, options);
  chain.advance(steps);
  return Fields(chain);
}

TEST(BurnOnRanks, agree_with_one_rank_whatever_the_partitioner) {
  const SurfaceMesh mesh = grid_mesh(8, 6, edge);
  Options options = burning_options(0.8, 0.6);
  const Fields alone = fields_after(PETSC_COMM_SELF, mesh, options, 20);
  EXPECT_LT(alone.all[3].minCoeff(), 0.9 * 0.08 * edge * edge / 8) << "nothing burnt";
  for (const char* partitioner : {"metis", "ptscotch", "simple"}) {
    options.sheet.partitioner = partitioner;
    expect_close(fields_after(PETSC_COMM_WORLD, mesh, options, 20), alone, 1e-9, partitioner);
  }
}

TEST(BurnOnRanks, agree_whatever_the_matrix) {
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

TEST(BurnOnRanks, agree_with_a_rank_that_has_nothing) {
  const SurfaceMesh mesh = grid_mesh(3, 1, edge);
  Options options = burning_options(0.3, 0.1);
  const Fields alone = fields_after(PETSC_COMM_SELF, mesh, options, 20);
  for (const char* type : {"aij", "sell", "shell", "lines"}) {
    options.project.mat_type = type;
    Chain chain(PETSC_COMM_WORLD, mesh, options);
    PetscInt least = chain.sheet.owned_cells;
    MPI_Allreduce(MPI_IN_PLACE, &least, 1, MPIU_INT, MPI_MIN, PETSC_COMM_WORLD);
    EXPECT_EQ(least == 0, ranks() > 3);
    chain.advance(20);
    expect_close(Fields(chain), alone, 1e-9, type);
  }
}

}  // namespace
}  // namespace pellicle
