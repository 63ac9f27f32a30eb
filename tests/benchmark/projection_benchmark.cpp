// Time of one full projection (7 steps of four colours) of a wrinkled sheet, by number of springs and solver. The
// counters say where the time goes; `error` is ||C|| / ||l|| at the end, `error_change` its relative distance from the
// error that solves to 1e-10 leave.
//
//     OPENBLAS_NUM_THREADS=1 build/release/tests/benchmark_pellicle --benchmark_filter=projection/100000
//
// One rank. Ratios within one run are what counts: a busy machine slows all alike.

#include <benchmark/benchmark.h>
#include <petscksp.h>

#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/error.h"
#include "meshing/generators.h"
#include "projection/successive_projection.h"
#include "surface/shell.h"

namespace pellicle {
namespace {

/// A square sheet of paper that has crumpled because its upper layer shrank to nine tenths (Fig. 7 c), about to be
/// projected once more.
struct WrinkledSheet {
  Sheet sheet;
  std::array<std::vector<double>, 4> target_length;
  std::vector<double> mass;
  std::vector<bool> pinned;
  Field positions;
  ActiveSet active{sheet};

  ProjectionInput input() const { return {target_length, mass, pinned, active}; }
  PetscInt springs() const {
    PetscInt count = 0;
    for (const SpringSet& set : sheet.springs) {
      count += set.owned();
    }
    return count;
  }
};

void set_target_lengths(WrinkledSheet& wrinkled, double ratio) {
  for (const Colour colour : all_colours) {
    const SpringSet& set = wrinkled.sheet.of(colour);
    std::vector<double>& lengths = wrinkled.target_length[static_cast<std::size_t>(colour)];
    lengths = set.initial_length;
    for (std::size_t s = 0; s < lengths.size(); ++s) {
      for (const PetscInt end : set.ends[s]) {
        lengths[s] *= wrinkled.sheet.is_lattice[end] ? 1 : (1 + ratio) / 2;
      }
    }
  }
}

std::unique_ptr<WrinkledSheet> make_wrinkled_sheet(int cells_a_side) {
  auto wrinkled = std::make_unique<WrinkledSheet>();
  SheetOptions options;
  options.thickness = 0.25 / cells_a_side;
  options.perturbation = 0.01;
  Sheet& sheet = wrinkled->sheet;
  sheet = make_sheet(PETSC_COMM_SELF, rectangle_mesh({cells_a_side, cells_a_side}, {1, 1}), options);
  wrinkled->mass = sheet.initial_mass;
  wrinkled->pinned.assign(wrinkled->mass.size(), false);
  wrinkled->positions = Field(sheet.particles, 3);
  wrinkled->active = ActiveSet(sheet);
  Field& x = wrinkled->positions;
  x.values() = perturbed_positions(sheet, options);
  Eigen::MatrixXd displacement = Eigen::MatrixXd::Zero(3, sheet.particles.local());
  SuccessiveProjection projection(sheet, {});
  constexpr int steps = 30;
  for (int step = 1; step <= steps; ++step) {
    set_target_lengths(*wrinkled, 1 - 0.1 * step / steps);
    const Eigen::MatrixXd before = x.values();
    x.values() += 0.9 * displacement;
    if (step < steps) {
      projection.advance(x, wrinkled->input());
      displacement = x.values() - before;
    }
  }
  return wrinkled;
}

/// Sheets made so far; emptied before PETSc ends.
std::map<int, std::unique_ptr<WrinkledSheet>> wrinkled_sheets;

const WrinkledSheet& wrinkled_sheet(int cells_a_side) {
  auto& sheet = wrinkled_sheets[cells_a_side];
  if (sheet == nullptr) {
    sheet = make_wrinkled_sheet(cells_a_side);
  }
  return *sheet;
}

/// ||C|| / ||l|| of the sheet's initial lengths.
double relative_error(const WrinkledSheet& wrinkled, double error) {
  double squared_length = 0;
  for (const SpringSet& set : wrinkled.sheet.springs) {
    for (const double length : set.initial_length) {
      squared_length += length * length;
    }
  }
  return error / std::sqrt(squared_length);
}

/// ||C|| that a projection with exact solves leaves.
double exact_error(const WrinkledSheet& wrinkled, double shift) {
  static std::map<std::pair<const WrinkledSheet*, double>, double> errors;
  const auto [place, is_new] = errors.insert({{&wrinkled, shift}, 0});
  if (is_new) {
    ProjectOptions options;
    options.shift = shift;
    options.ksp_rtol = 1e-10;
    Field x(wrinkled.sheet.particles, 3);
    x.values() = wrinkled.positions.values();
    place->second = SuccessiveProjection(wrinkled.sheet, options).advance(x, wrinkled.input()).error;
  }
  return place->second;
}

/// Seconds that a PETSc event has taken so far.
double event_seconds(const char* name) {
  PetscLogEvent event = -1;
  check(PetscLogEventGetId(name, &event));
  PetscEventPerfInfo info;
  check(PetscLogEventGetPerfInfo(0, event, &info));
  return info.time;
}

/// A choice of options to be compared.
struct Configuration {
  std::string name;
  ProjectOptions options;
  std::map<std::string, std::string> petsc;  ///< by name without the prefix of the colours
};

void project_wrinkled_sheet(benchmark::State& state, const Configuration& configuration, int cells_a_side) {
  const WrinkledSheet& wrinkled = wrinkled_sheet(cells_a_side);
  const double exact = exact_error(wrinkled, configuration.options.shift);
  for (const char* colour : colour_names) {
    for (const auto& [name, value] : configuration.petsc) {
      check(PetscOptionsSetValue(nullptr, ("-project_" + std::string(colour) + "_" + name).c_str(), value.c_str()));
    }
  }
  SuccessiveProjection projection(wrinkled.sheet, configuration.options);
  Field x(wrinkled.sheet.particles, 3);
  const auto project = [&] {
    x.values() = wrinkled.positions.values();
    return projection.advance(x, wrinkled.input());
  };
  StageResult result = project();  // The first one also sets up what depends on the topology.
  const std::vector<const char*> events{"KSPSolve", "PCSetUp", "PCSetUpOnBlocks", "MatConvert", "PCApply", "MatMult"};
  std::map<std::string, double> seconds;
  for (const char* event : events) {
    seconds[event] = -event_seconds(event);
  }
  for (auto _ : state) {
    result = project();
  }
  for (const char* event : events) {
    state.counters[std::string("ms_") + event] =
        benchmark::Counter(1e3 * (seconds[event] + event_seconds(event)), benchmark::Counter::kAvgIterations);
  }
  if (!result.converged) {
    state.SkipWithError(result.reason.c_str());
  }
  state.counters["iterations"] = result.iterations;
  state.counters["error"] = relative_error(wrinkled, result.error);
  state.counters["error_change"] = result.error / exact - 1;
  state.counters["springs_per_second"] =
      benchmark::Counter(static_cast<double>(wrinkled.springs()), benchmark::Counter::kIsIterationInvariantRate);
  for (const char* colour : colour_names) {
    for (const auto& [name, value] : configuration.petsc) {
      check(PetscOptionsClearValue(nullptr, ("-project_" + std::string(colour) + "_" + name).c_str()));
    }
  }
}

std::vector<Configuration> configurations() {
  ProjectOptions ours;
  ProjectOptions paper;
  paper.ksp_rtol = 1e-6;
  paper.mat_type = "sell";
  ProjectOptions paper_rows = paper;
  paper_rows.mat_type = "aij";
  const std::map<std::string, std::string> plain{{"ksp_type", "cg"}, {"pc_type", "none"}};
  ProjectOptions rows = ours;
  rows.mat_type = "aij";
  ProjectOptions tight = ours;
  tight.ksp_rtol = 1e-6;
  ProjectOptions loose = ours;
  loose.ksp_rtol = 1e-2;
  return {{"paper", paper, plain}, {"paper_aij", paper_rows, plain}, {"icc", rows, {}},
          {"ours", ours, {}},      {"ours_1e-6", tight, {}},         {"ours_1e-2", loose, {}}};
}

}  // namespace
}  // namespace pellicle

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  PetscInitialize(&argc, &argv, nullptr, nullptr);
  PetscLogDefaultBegin();
  for (const int cells_a_side : {10, 20, 40, 50, 100, 316, 632}) {
    for (const pellicle::Configuration& configuration : pellicle::configurations()) {
      const int springs = 10 * cells_a_side * cells_a_side;
      benchmark::RegisterBenchmark(("projection/" + std::to_string(springs) + "/" + configuration.name).c_str(),
                                   pellicle::project_wrinkled_sheet, configuration, cells_a_side)
          ->Unit(benchmark::kMillisecond);
    }
  }
  benchmark::RunSpecifiedBenchmarks();
  pellicle::wrinkled_sheets.clear();
  PetscFinalize();
}
