// What a run of a burning sheet draws, and that removing empty cells changes nothing of it.

#include <gtest/gtest.h>
#include <vtkIdList.h>

#include <array>
#include <cmath>

#include "tests/support/alone.h"
#include "tests/support/frames.h"
#include "tests/support/grid_mesh.h"
#include "tests/support/picture.h"
#include "tests/support/solver_options.h"
#include "tests/world/one_object.h"
#include "tests/world/whole.h"

namespace pellicle::burn_run_test {
namespace {

constexpr double edge = 0.1;  // [m]
constexpr double h = 2e-3;    // [s]
constexpr int steps = 8;

/// A strip that is led by a corner while a hot ball burns a hole into it and parts it.
Options burning_options(const TestFolder& folder) {
  Options options;
  options.dynamics = Dynamics::projection;
  options.sheet.thickness = edge / 2;
  options.sheet.perturbation = 0.02;
  options.sheet.areal_density = 1;
  options.force.gravity = {0.3, 0, -2};
  options.heat.convection = 60;
  options.heat.ksp_rtol = 1e-14;
  options.heat.diffusivity_texture = write_picture(folder);
  HeatSource& ball = options.heat.sources["ball"];
  ball.centre = {0.42, 0.1, 0};
  ball.velocity = {5, 0, 0};
  ball.radius = 0.3;
  ball.temperature = 2000;
  ball.rate = 1000;
  options.combustion.ignition_temperature = 900;
  options.combustion.mass_loss_rate = 1;
  options.combustion.mass_loss_texture = options.heat.diffusivity_texture;
  options.combustion.mass_loss_range = {0.8, 1.2};
  options.ablation.loss_mass = 0.5;
  options.project.max_steps = 3;
  options.project.ksp_rtol = 1e-13;
  options.project.weight.fill(0.5);
  options.pins["hook"].vertices = {0};
  options.pins["hook"].velocity = {-0.5, 0, 0.5};
  options.output.name = "strip";
  return options;
}

SurfaceMesh strip() { return grid_mesh(8, 2, edge); }

/// Runs the strip, with a frame of each step. @param is_spread whether first most of it goes to other ranks
/// @returns what it printed, on rank 0
std::string run_strip(const Options& options, bool is_spread = false) {
  OneObject run(strip(), options, ChainKind::burn, 1);
  if (is_spread) {
    const Sheet& sheet = run.sheet();
    std::vector<double> load;
    for (PetscInt i = 0; i < sheet.particles.owned; ++i) {
      load.push_back(sheet.rest(0, i) < 2 * edge ? 20 : 1);
    }
    run.object().spread(load);
  }
  run.begin();
  for (int k = 1; k <= steps; ++k) {
    const StepResult result = run.world().step(h);
    EXPECT_TRUE(result.converged) << result.reason;
    run.draw();
    run.record(0);
  }
  MPI_Barrier(PETSC_COMM_WORLD);
  return run.said();
}

/// Expects the same of two runs of the strip.
void expect_same_runs(const std::filesystem::path& one, const std::filesystem::path& other) {
  const auto whole = read_csv(one / "history.csv");
  const auto compacted = read_csv(other / "history.csv");
  EXPECT_GE(whole.at("pieces").back(), 2);
  for (const auto& [name, column] : whole) {
    const bool is_of_solver = name.find("seconds_") == 0 || name.find("_iterations") != std::string::npos;
    for (std::size_t row = 0; row < column.size() && !is_of_solver; ++row) {
      EXPECT_NEAR(compacted.at(name)[row], column[row], 1e-8 * std::abs(column[row]) + 1e-9) << name << " " << row;
    }
  }
  const auto frames = read_pvd(one / "strip.pvd");
  const auto others = read_pvd(other / "strip.pvd");
  ASSERT_EQ(frames.size(), others.size());
  for (std::size_t frame = 0; frame < frames.size(); ++frame) {
    expect_same_remains(read_frame(frames[frame].first, frames[frame].second),
                        read_frame(others[frame].first, others[frame].second), 1e-7, "frame " + std::to_string(frame));
  }
}

TEST(BurnRun, GoesOnAsBeforeWhenEmptyCellsAreRemoved) {
  const TestFolder folder;
  Options options = burning_options(folder);
  options.ablation.compact_fraction = 1;
  options.output.directory = folder / "whole";
  run_strip(options);
  options.ablation.compact_fraction = 0;
  options.output.directory = folder / "compacted";
  const std::string said = run_strip(options);
  if (folder.rank() == 0) {
    EXPECT_NE(said.find("cells are gone"), std::string::npos) << said;
  }
  expect_same_runs(folder / "whole", folder / "compacted");
}

TEST(BurnRun, GoesOnAsBeforeWhenItIsSpreadAnew) {
  const TestFolder folder;
  Options options = burning_options(folder);
  options.output.directory = folder / "stays";
  run_strip(options);
  options.output.directory = folder / "spread";
  const std::string said = run_strip(options, true);
  int ranks = 1;
  MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
  if (folder.rank() == 0) {
    EXPECT_EQ(said.find("step 0: ranks: ") != std::string::npos, ranks > 1) << said;
  }
  expect_same_runs(folder / "stays", folder / "spread");
}

/// Expects that a frame of the springs has those that live, each as it is.
void expect_springs(const std::filesystem::path& path, const Whole& now, const Eigen::RowVectorXd& initial_mass) {
  const auto drawn = read_pvtp(path);
  vtkDataArray* ids = drawn->GetPointData()->GetArray("vertex_id");
  const auto value = [&drawn](const char* name, vtkIdType line) {
    return drawn->GetCellData()->GetArray(name)->GetComponent(line, 0);
  };
  using Key = std::array<long, 3>;  // colour and both ends
  const auto key = [](long colour, long a, long b) { return Key{colour, std::min(a, b), std::max(a, b)}; };
  std::map<Key, vtkIdType> lines;
  vtkNew<vtkIdList> ends;
  for (vtkIdType line = 0; line < drawn->GetNumberOfCells(); ++line) {
    drawn->GetCellPoints(line, ends);
    const auto id = [&](int end) { return std::lround(ids->GetComponent(ends->GetId(end), 0)); };
    lines[key(std::lround(value("colour", line)), id(0), id(1))] = line;
  }
  std::size_t active = 0;
  for (const Whole::Spring& spring : now.springs) {
    const auto line = lines.find(key(static_cast<long>(spring.colour), spring.a, spring.b));
    ASSERT_EQ(line != lines.end(), spring.lives);
    if (spring.lives) {
      ++active;
      const double strain = (now.x.col(spring.a) - now.x.col(spring.b)).norm() / spring.target - 1;
      EXPECT_NEAR(value("strain", line->second), strain, 1e-6);
      EXPECT_NEAR(value("target_length", line->second), spring.target, 1e-7);
      const auto has_burnt = [&](int id) { return now.mass[id] < 0.5 * initial_mass[id]; };
      EXPECT_EQ(value("state", line->second), (has_burnt(spring.a) ? 1 : 0) + (has_burnt(spring.b) ? 1 : 0));
    }
  }
  EXPECT_EQ(lines.size(), active);
}

TEST(BurnRun, DrawsWhatTheStateSays) {
  const TestFolder folder;
  if (ranks() > 2) {
    GTEST_SKIP() << "on one and two ranks only";
  }
  Options options = burning_options(folder);
  options.ablation.compact_fraction = 1;
  options.output.directory = folder / "out";
  options.output.springs = true;
  run_strip(options);
  const auto spring_frames = read_pvd(folder / "out/strip_springs.pvd");
  const auto frames = read_pvd(folder / "out/strip.pvd");
  ASSERT_EQ(frames.size(), steps + 1U);

  Alone alone(strip(), options);
  const Sheet& sheet = alone.sheet();
  const State& state = alone.state();
  const Eigen::RowVectorXd initial_mass = Whole(sheet, state).mass;
  std::map<int, double> burn_time;  // of cells by the id of their lattice points
  double split_time = HUGE_VAL;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    if (k > 0) {
      ASSERT_TRUE(alone.advance(h).converged);
    }
    const Whole now(sheet, state);
    const DrawnFrame frame = read_frame(frames[k].first, frames[k].second);
    EXPECT_DOUBLE_EQ(frame.time, state.time);
    expect_springs(spring_frames.at(k).second, now, initial_mass);

    std::vector<double> squared_strain(now.mass.size(), 0);
    std::vector<double> springs(squared_strain.size(), 0);
    for (const Whole::Spring& spring : now.springs) {
      for (const int end : {spring.a, spring.b}) {
        const double strain = (now.x.col(spring.a) - now.x.col(spring.b)).norm() / spring.target - 1;
        squared_strain[end] += spring.lives ? strain * strain : 0;
        springs[end] += spring.lives ? 1 : 0;
      }
    }
    std::size_t corners = 0;
    for (const auto& [id, place] : frame.points.at("position")) {
      if (id < 0 || id >= sheet.first_lattice_id) {
        continue;  // a cut point, or the middle of a cell
      }
      ++corners;
      for (int c = 0; c < 3; ++c) {
        EXPECT_NEAR(place[c], now.x(c, id), 1e-6);
        EXPECT_NEAR(frame.points.at("velocity").at(id)[c], now.v(c, id), 1e-5) << id;
      }
      EXPECT_NEAR(frame.points.at("temperature").at(id)[0], now.temperature[id], 1e-3) << id;
      const auto i = static_cast<std::size_t>(id);
      const double strain = springs[i] > 0 ? std::sqrt(squared_strain[i] / springs[i]) : 0;
      EXPECT_NEAR(frame.points.at("strain").at(id)[0], strain, 1e-6 + 1e-5 * strain) << id;
    }
    EXPECT_GE(corners, k == 0 ? 27U : 10U);

    const std::vector<double> masses = now.pieces();
    if (masses.size() > 1) {
      split_time = std::min(split_time, state.time);
    }
    for (const Whole::Cell& cell : now.cells) {
      const auto has_burnt = [&](int id) { return now.mass[id] < 0.5 * initial_mass[id]; };
      if (has_burnt(cell.lattice) || std::any_of(cell.corners.begin(), cell.corners.end(), has_burnt)) {
        burn_time.emplace(cell.lattice, state.time);
      }
      const long id = cell.lattice - sheet.first_lattice_id;
      const auto drawn = frame.cell_values.at("burn_time").find(id);
      if (drawn == frame.cell_values.at("burn_time").end()) {
        continue;  // Nothing of it is left.
      }
      const auto began = burn_time.find(cell.lattice);
      EXPECT_NEAR(drawn->second[0], began == burn_time.end() ? -1 : began->second, 1e-9) << "cell " << id;
      const double piece = frame.cell_values.at("piece").at(id)[0];
      const double birth_time = frame.cell_values.at("piece_birth_time").at(id)[0];
      ASSERT_GE(piece, 0) << "cell " << id;
      EXPECT_NEAR(frame.cell_values.at("piece_mass").at(id)[0], masses.at(static_cast<std::size_t>(piece)), 1e-6);
      EXPECT_NEAR(birth_time, piece == 0 ? 0 : split_time, 1e-9);
    }
  }
  EXPECT_LT(split_time, steps * h);
}

}  // namespace
}  // namespace pellicle::burn_run_test
