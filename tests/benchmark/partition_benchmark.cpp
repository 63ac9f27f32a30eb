// What METIS makes of a square sheet of 1,000,000 cells (9,996,000 springs) in 2 to 4,096 parts, without ranks to hold
// them, and of one of 10,000 cells, which ranks can hold. The time is METIS's, on one rank; the counters are of the
// worst part, and means:
//
//     build/release/tests/benchmark_pellicle --benchmark_filter=partition
//
// - cells, cells_max; imbalance: of the cells, largest over mean
// - particles: mean; ghosts, ghosts_max: particles of others that a part holds, two layers of cells deep
// - neighbours, neighbours_max: parts that it has ghosts of
// - halo_bytes, halo_bytes_max: received and sent when the positions of all ghosts are brought up to date
//
// tests/surface compares these counts with those of sheets on as many ranks.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/partition_halo.h"

namespace pellicle {
namespace {

/// Corners of square cells, row by row.
std::vector<PetscInt> square_of_quads(PetscInt cells_a_side) {
  std::vector<PetscInt> corners;
  corners.reserve(4 * cells_a_side * cells_a_side);
  for (PetscInt row = 0; row < cells_a_side; ++row) {
    for (PetscInt column = 0; column < cells_a_side; ++column) {
      const PetscInt first = row * (cells_a_side + 1) + column;
      corners.insert(corners.end(), {first, first + 1, first + cells_a_side + 2, first + cells_a_side + 1});
    }
  }
  return corners;
}

void partition(benchmark::State& state, PetscInt cells_a_side, int parts) {
  const std::vector<PetscInt> corners = square_of_quads(cells_a_side);
  const CellGraph graph = graph_of_quads(corners);
  std::vector<int> part;
  for (auto _ : state) {
    part = partition_with_metis(graph, parts);
  }
  const std::vector<PartHalo> halos = halos_of_sheet(corners, part, parts);
  const auto count = [&](const std::string& name, const auto& of) {
    double sum = 0;
    double most = 0;
    for (const PartHalo& halo : halos) {
      sum += static_cast<double>(of(halo));
      most = std::max(most, static_cast<double>(of(halo)));
    }
    state.counters[name] = sum / parts;
    state.counters[name + "_max"] = most;
    return most * parts / sum;
  };
  state.counters["imbalance"] = count("cells", [](const PartHalo& halo) { return halo.cells; });
  count("particles", [](const PartHalo& halo) { return halo.particles; });
  count("ghosts", [](const PartHalo& halo) { return halo.ghosts; });
  count("neighbours", [](const PartHalo& halo) { return halo.neighbours; });
  constexpr PetscInt bytes_of_a_position = 24;
  count("halo_bytes", [](const PartHalo& halo) { return bytes_of_a_position * (halo.ghosts + halo.sent); });
}

[[maybe_unused]] const bool partitions_registered = [] {
  for (const auto& [cells_a_side, most_parts] : {std::pair{100, 64}, std::pair{1000, 4096}}) {
    for (int parts = 2; parts <= most_parts; parts *= 2) {
      const std::string name =
          "partition/" + std::to_string(cells_a_side * cells_a_side) + "/parts:" + std::to_string(parts);
      benchmark::RegisterBenchmark(name.c_str(), partition, cells_a_side, parts)
          ->Unit(benchmark::kMillisecond)
          ->Iterations(1);
    }
  }
  return true;
}();

}  // namespace
}  // namespace pellicle
