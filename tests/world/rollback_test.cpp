// A step that is undone leaves no trace: neither in any field of the state, nor in what is written later.

#include <gtest/gtest.h>

#include <filesystem>

#include "meshing/closed_shapes.h"
#include "meshing/triangulation.h"
#include "surface/shell.h"
#include "tests/io/files.h"
#include "tests/support/csv.h"
#include "tests/support/grid_mesh.h"
#include "tests/support/solver_options.h"
#include "tests/support/state_values.h"
#include "tests/world/one_object.h"

namespace pellicle::rollback_test {
namespace {

/// Expects that each value of a state has changed, which shows that restoring a copy has an effect.
void expect_all_differ(const StateValues& values, const StateValues& others) {
  for (const auto& [name, value] : values) {
    ASSERT_FALSE(value.empty()) << name;
    EXPECT_NE(value, others.at(name)) << name << " is as it was";
  }
}

/// Restoring a copy leaves no trace of what has happened since.
void expect_put_back(State& state, const Surface& surface) {
  const StateValues before = values_of(state);
  FieldRegistry copy(surface.particles, surface.elements.local());  // learns of the fields
  copy = state;
  spoil(state);
  expect_all_differ(values_of(state), before);
  state = copy;
  EXPECT_EQ(values_of(state), before);
  state.position.update_ghosts();  // Its vector still is that of its values.
  EXPECT_EQ(values_of(state), before);
}

TEST(Rollback, AssigningAStatePutsEveryFieldBack) {
  const Sheet sheet = make_sheet(PETSC_COMM_SELF, grid_mesh(2, 1, 1), {});
  State state(sheet, Options(), 1);
  state.burning->pieces = initial_pieces(sheet);
  expect_put_back(state, sheet);
}

TEST(Rollback, AssigningABalloonsStatePutsEveryFieldBack) {
  const Membrane membrane = make_membrane(PETSC_COMM_SELF, icosphere_mesh(0, 1), {});
  Options options;
  options.chain = ChainKind::inflate;
  options.time.arc_length = 1;
  options.gas.links["pipe"] = {};
  for (const TimeScheme scheme : {TimeScheme::generalized_alpha, TimeScheme::statics}) {
    options.time.scheme = scheme;
    State state(membrane, options, 2);
    expect_put_back(state, membrane);
  }
}

TEST(Rollback, AssigningABurningBalloonsStatePutsEveryFieldBack) {
  Membrane membrane = make_membrane(PETSC_COMM_SELF, icosphere_mesh(0, 1), {});
  set_burnable(membrane, std::vector<double>(membrane.triangles.size(), 1));
  Options options;
  options.chain = ChainKind::inflate;
  options.heat.convection = 1;
  State state(membrane, options, 2);
  state.burning->pieces = initial_pieces(membrane);
  for (const Colour none : {Colour::red, Colour::green, Colour::yellow}) {
    state.burning->active.springs[static_cast<std::size_t>(none)] = {true};  // to be seen to be put back
  }
  expect_put_back(state, membrane);
}

TEST(Rollback, AFieldOfAnotherSizeIsRefused) {
  const Sheet sheet = make_sheet(PETSC_COMM_SELF, grid_mesh(2, 1, 1), {});
  Field vectors(sheet.particles, 3);
  const Field numbers_only(sheet.particles, 1);
  EXPECT_THROW(vectors = numbers_only, std::logic_error);
}

/// What a run has written: the text of each file by its name, tables as numbers without the seconds of stages.
struct Written {
  explicit Written(const std::filesystem::path& folder) {
    MPI_Barrier(MPI_COMM_WORLD);
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
      const std::string name = entry.path().lexically_relative(folder).string();
      if (entry.path().extension() == ".csv") {
        for (auto& [column, values] : read_csv(entry.path())) {
          if (column.rfind("seconds_", 0) != 0) {
            tables[name + ": " + column] = values;
          }
        }
      } else if (entry.is_regular_file() && name != "run.yaml" && name != "run_files.txt") {  // which have the date
        files[name] = file_text(entry.path().string());
      }
    }
  }

  std::map<std::string, std::string> files;
  std::map<std::string, std::vector<double>> tables;
};

void accepted_step(WorldOutput& run, double h) {
  const StepResult result = run.world().step(h);
  ASSERT_TRUE(result.converged) << result.reason;
  run.record(0);
}

/// Two steps of length h, then the attempts, each of which is undone, and two more steps. Frames are drawn of the
/// restored states and of the last state.
void run_with_attempts(WorldOutput& run, double h, const std::vector<double>& attempts) {
  run.begin();
  accepted_step(run, h);
  accepted_step(run, h);
  run.keep();
  for (const double length : attempts) {
    run.advance(length);
    run.restore();
  }
  run.draw();
  accepted_step(run, h);
  accepted_step(run, h);
  run.draw();
}

/// A run of an object that undoes attempts writes the same as one that makes none. @returns what that is
Written expect_no_trace(Options options, const SurfaceMesh& mesh, double h) {
  const TestFolder folder;
  const auto written = [&](const std::string& name, const std::vector<double>& attempts) {
    options.output.directory = folder / name;
    options.output.name = "run";
    {
      OneObject run(mesh, options, options.chain);
      run_with_attempts(run, h, attempts);
    }
    return Written(folder / name);
  };
  const Written straight = written("straight", {});
  const Written attempts = written("attempts", {h, 4 * h});
  EXPECT_EQ(straight.tables, attempts.tables);
  EXPECT_GT(straight.files.size(), 4U);
  for (const auto& [name, text] : straight.files) {
    const auto other = attempts.files.find(name);
    EXPECT_TRUE(other != attempts.files.end() && other->second == text) << name << " differs";
  }
  return straight;
}

TEST(Rollback, AnAttemptOfABurningSheetLeavesNoTrace) {
  if (ranks() > 2) {
    GTEST_SKIP() << "on one and two ranks only";
  }
  // A strip of five cells, whose fourth burns away in the third step, with what joins it to the others.
  Options options;
  options.sheet.thickness = 0.05;
  options.sheet.perturbation = 0.01;
  options.heat.convection = 100;
  options.ablation.loss_mass = 0.5;
  options.combustion.ignition_temperature = 900;
  options.combustion.mass_loss_rate = 5;
  constexpr double h = 2e-3;
  HeatSource& ball = options.heat.sources["ball"];
  ball.centre = {0.35, 0.05, 0};
  ball.radius = 0.2;
  ball.temperature = 2000;
  ball.rate = 1000;
  ball.start_time = 1.9 * h;
  for (const auto& [dynamics, method] : {std::pair("projection", "successive"),
                                         {"projection", "joint"},
                                         {"spring", "successive"},
                                         {"elastic", "successive"}}) {
    options.dynamics = dynamics;
    options.project.method = method;
    const Written written = expect_no_trace(options, grid_mesh(5, 1, 0.1), h);
    EXPECT_EQ(written.tables.at("history.csv: pieces"), (std::vector<double>{1, 1, 1, 2, 2}));
  }
}

TEST(Rollback, AnAttemptOfATearingSheetLeavesNoTrace) {
  if (ranks() > 2) {
    GTEST_SKIP() << "on one and two ranks only";
  }
  // A strip that cracks in its first steps, and again in attempts and after them.
  Options options;
  options.sheet.perturbation = 0.01;
  options.material.tensile_stiffness = 5000;
  options.material.shear_stiffness = 1900;
  options.ablation.strength = 30;
  options.ablation.strength_scatter = 0.5;
  options.pins["left"].box = {-1, -1, -1, 1e-6, 1, 1};
  options.pins["right"].box = {0.8 - 1e-6, -1, -1, 1, 1, 1};
  options.pins["right"].velocity = {1.5, 0, 0};
  constexpr double h = 2e-3;
  const Written written = expect_no_trace(options, grid_mesh(8, 8, 0.1), h);
  const std::vector<double>& sides = written.tables.at("history.csv: cracked_sides");
  EXPECT_GT(sides[2], 0);
  EXPECT_GT(sides[4], sides[2]);
}

Written expect_no_trace_in_a_balloon(Options options, const SurfaceMesh& mesh = icosphere_mesh(1, 0.05)) {
  options.chain = ChainKind::inflate;
  return expect_no_trace(options, mesh, 5e-3);
}

TEST(Rollback, AnAttemptOfABalloonLeavesNoTrace) {
  if (ranks() > 2) {
    GTEST_SKIP() << "on one and two ranks only";
  }
  Options options;
  options.chambers["gas"].pressure = {{0, 0}, {0.02, 2000}};
  options.prism.stiffness_damping = 1e-3;
  for (const char* rule : {"global", "plane_stress"}) {
    options.wall.thickness_rule = rule;
    expect_no_trace_in_a_balloon(options);
  }
}

TEST(Rollback, AnAttemptOfABurningBalloonLeavesNoTrace) {
  SolverOptions solvers;  // a preconditioner that remembers nothing
  solvers.set("prism_pc_type", "pbjacobi");
  Options options;
  options.chambers["gas"].law = "pressure";
  options.chambers["gas"].pressure = {{0, 1}};
  options.combustion.mass_loss_rate = 0.1;
  options.combustion.burnt_density = 0.3 * options.combustion.initial_density;  // no shrinkage
  options.ablation.loss_mass = 0.5;
  HeatSource& ball = options.heat.sources["ball"];
  ball.centre = {0.06, 0, 0};
  ball.radius = 0.07;
  ball.temperature = 2000;
  ball.rate = 500;
  expect_no_trace_in_a_balloon(options);
}

TEST(Rollback, AnAttemptOfATearingWallLeavesNoTrace) {
  SolverOptions solvers;  // a preconditioner that remembers nothing
  solvers.set("prism_pc_type", "pbjacobi");
  // A strip that cracks in its first steps, and again in attempts and after them.
  Options options;
  options.wall.thickness = 1e-3;
  options.wall.density = 2e4;  // so that no tangent is indefinite, for which preconditioners do remember something
  options.prism.mass_damping = 100;
  options.ablation.strength = 25;
  options.ablation.strength_scatter = 0.5;
  options.pins["left"].box = {-1, -1, -1, 1e-6, 1, 1};
  options.pins["right"].box = {0.4 - 1e-6, -1, -1, 1, 1, 1};
  options.pins["right"].velocity = {0.8, 0, 0};
  const Written written = expect_no_trace_in_a_balloon(options, triangulated(grid_mesh(8, 8, 0.05)));
  const std::vector<double>& sides = written.tables.at("history.csv: cracked_sides");
  EXPECT_GT(sides[2], 0);
  EXPECT_GT(sides[4], sides[2]);
}

TEST(Rollback, AnAttemptAtAPrescribedVolumeLeavesNoTrace) {
  Options options;
  options.chambers["gas"].law = "volume";
  options.chambers["gas"].volume_ratio = {{0, 1}, {0.05, 3}};
  expect_no_trace_in_a_balloon(options);
}

}  // namespace
}  // namespace pellicle::rollback_test
