#include "parallel/partition.h"

#include <metis.h>

#include <utility>

#include "base/error.h"

namespace pellicle {
inline namespace parallel {

namespace {

/// @param method METIS_PartGraphKway or METIS_PartGraphRecursive
std::vector<int> split(CellGraph graph, int parts, decltype(&METIS_PartGraphKway) method) {
  static_assert(sizeof(idx_t) == sizeof(int), "METIS must be built with 32-bit indices");
  idx_t cells = graph.cells();
  std::vector<int> part(static_cast<std::size_t>(cells), 0);
  if (parts == 1 || cells == 0) {
    return part;
  }
  if (cells <= parts) {  // METIS wants more vertices than parts: a cell a rank, the other ranks stay empty.
    for (idx_t cell = 0; cell < cells; ++cell) {
      part[static_cast<std::size_t>(cell)] = cell;
    }
    return part;
  }
  idx_t constraints = 1;
  idx_t edge_cut = 0;
  idx_t options[METIS_NOPTIONS];
  METIS_SetDefaultOptions(options);
  options[METIS_OPTION_SEED] = 0;
  // Equal weights, but not of 1: METIS takes whole ones, and finds 3 cells and none as even as 2 and 1.
  std::vector<idx_t> weights(static_cast<std::size_t>(cells), 20);
  const int status = method(&cells, &constraints, graph.offsets.data(), graph.neighbours.data(), weights.data(),
                            nullptr, nullptr, &parts, nullptr, nullptr, options, &edge_cut, part.data());
  if (status != METIS_OK) {
    throw Error("METIS could not split " + std::to_string(cells) + " cells into " + std::to_string(parts) + " parts");
  }
  return part;
}

}  // namespace

std::vector<int> partition_with_metis(CellGraph graph, int parts) {
  return split(std::move(graph), parts, METIS_PartGraphKway);
}

std::vector<int> split_in_patches(CellGraph graph, int patches) {
  return split(std::move(graph), patches, METIS_PartGraphRecursive);
}

}  // namespace parallel
}  // namespace pellicle
