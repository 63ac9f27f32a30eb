// What burning away costs in a step, by number of springs: a circular front moves outwards from the middle of a sheet,
// a tenth of a cell a step.
//
//     OPENBLAS_NUM_THREADS=1 build/release/tests/benchmark_pellicle --benchmark_filter=ablation/.*100000
//
// - quiet: the level set and what it leaves dead, when nothing burns
// - front: a step of the front: the level set, triangles and springs that die, particles that they constrained, the
// pieces
// - pieces: of that the pieces
//
// One rank.

#include <benchmark/benchmark.h>

#include <string>
#include <vector>

#include "ablation/ablation.h"
#include "meshing/generators.h"
#include "surface/pieces.h"
#include "surface/shell.h"

namespace pellicle {
namespace {

/// A square sheet of side 1 that burns from its middle.
struct BurningSquare {
  explicit BurningSquare(int cells_a_side)
      : sheet(make_sheet(PETSC_COMM_SELF, rectangle_mesh({cells_a_side, cells_a_side}, {1, 1}), {})),
        active(sheet),
        pieces(initial_pieces(sheet)),
        mass(sheet.particles, 1) {
    burn(0);
  }

  /// What lies within a radius loses most of its mass.
  void burn(double radius) {
    const Eigen::Vector3d middle = sheet.rest.rowwise().mean();
    for (PetscInt i = 0; i < sheet.particles.local(); ++i) {
      const double fraction = (sheet.rest.col(i) - middle).norm() < radius ? 0.2 : 1;
      mass.data()[i] = fraction * sheet.initial_mass[i];
    }
  }

  bool burn_away() { return pellicle::burn_away(sheet, SpringRule::surface, active, level_set(sheet, mass, 0.5)); }

  Sheet sheet;
  ActiveSet active;
  Pieces pieces;
  Field mass;
};

void quiet(benchmark::State& state, int cells_a_side) {
  BurningSquare square(cells_a_side);
  for (auto _ : state) {
    benchmark::DoNotOptimize(square.burn_away());
  }
}

void front(benchmark::State& state, int cells_a_side) {
  BurningSquare square(cells_a_side);
  double radius = 0;
  int eventful = 0;
  for (auto _ : state) {
    state.PauseTiming();
    radius += 0.1 / cells_a_side;
    square.burn(radius);
    state.ResumeTiming();
    if (square.burn_away()) {
      benchmark::DoNotOptimize(bare_particles(square.sheet, square.active, square.mass));
      update_pieces(square.pieces, square.sheet, square.active, 1);
      ++eventful;
    }
  }
  state.counters["eventful"] = benchmark::Counter(eventful, benchmark::Counter::kAvgIterations);
}

void pieces(benchmark::State& state, int cells_a_side) {
  BurningSquare square(cells_a_side);
  square.burn(0.25);
  square.burn_away();
  for (auto _ : state) {
    update_pieces(square.pieces, square.sheet, square.active, 1);
  }
}

[[maybe_unused]] const bool registered = [] {
  for (const int cells_a_side : {32, 100, 316}) {
    const std::string size = std::to_string(10 * cells_a_side * cells_a_side);
    const auto add = [cells_a_side, &size](const std::string& name, auto* function) {
      return benchmark::RegisterBenchmark(("ablation/" + name + "/" + size).c_str(), function, cells_a_side)
          ->Unit(benchmark::kMillisecond);
    };
    add("quiet", quiet);
    add("front", front)->Iterations(5 * cells_a_side);  // until the front reaches the edges
    add("pieces", pieces);
  }
  return true;
}();

}  // namespace
}  // namespace pellicle
