#include "parallel/partition.h"

#include <metis.h>

#include <algorithm>
#include <numeric>
#include <utility>

#include "base/error.h"
#include "base/incidence.h"
#include "base/sorting.h"

namespace pellicle::parallel {

namespace {

/// Weights of a graph's cells and edges, and the fraction of each part in the whole; empty: all equal.
struct Weights {
  idx_t of_cell = 1;         ///< number of weights of a cell, each of which is balanced
  std::vector<idx_t> cells;  ///< weights of each cell
  std::vector<idx_t> neighbours;
  std::vector<real_t> parts;
};

/// @param method METIS_PartGraphKway or METIS_PartGraphRecursive
std::vector<int> split(CellGraph graph, Weights weights, int parts, decltype(&METIS_PartGraphKway) method) {
  static_assert(sizeof(idx_t) == sizeof(int), "METIS must be built with 32-bit indices");
  idx_t cells = graph.cells();
  std::vector<int> part(cells, 0);
  if (parts == 1 || cells == 0) {
    return part;
  }
  if (cells <= parts) {  // METIS wants more vertices than parts: a cell a rank, the other ranks stay empty.
    std::iota(part.begin(), part.end(), 0);
    return part;
  }
  idx_t edge_cut = 0;
  idx_t options[METIS_NOPTIONS];
  METIS_SetDefaultOptions(options);
  options[METIS_OPTION_SEED] = 0;
  if (weights.of_cell > 1) {
    options[METIS_OPTION_UFACTOR] = 10;  // thousandths more than its fraction that a part may have
  }
  weights.cells.resize(weights.of_cell * cells, 1);
  for (idx_t& weight : weights.cells) {
    weight *= 20;  // METIS wants integers, and takes 3 cells and none for as even as 2 and 1.
  }
  const int status =
      method(&cells, &weights.of_cell, graph.offsets.data(), graph.neighbours.data(), weights.cells.data(), nullptr,
             weights.neighbours.empty() ? nullptr : weights.neighbours.data(), &parts,
             weights.parts.empty() ? nullptr : weights.parts.data(), nullptr, options, &edge_cut, part.data());
  if (status != METIS_OK) {
    throw Error("METIS could not split " + std::to_string(cells) + " cells into " + std::to_string(parts) + " parts");
  }
  return part;
}

/// Joins each cell without a group with up to 5 neighbours without one. @returns the group of each cell
std::vector<int> small_groups(const CellGraph& graph, int& count) {
  constexpr int most = 5;
  std::vector<int> group(graph.cells(), -1);
  count = 0;
  for (std::size_t cell = 0; cell < group.size(); ++cell) {
    if (group[cell] >= 0) {
      continue;
    }
    group[cell] = count;
    int size = 1;
    for (int k = graph.offsets[cell]; k < graph.offsets[cell + 1] && size < most; ++k) {
      int& of_neighbour = group[graph.neighbours[k]];
      if (of_neighbour < 0) {
        of_neighbour = count;
        ++size;
      }
    }
    ++count;
  }
  return group;
}

/// The graph of groups of cells, weighted by their cells and edges.
CellGraph graph_of_groups(const CellGraph& graph, const std::vector<int>& group, int count, Weights& weights) {
  const Incidence cells_of(group, count);
  CellGraph coarse;
  std::vector<std::size_t> place(count, 0);  // of a neighbour, if in the present row
  for (int g = 0; g < count; ++g) {
    const std::size_t begin = coarse.neighbours.size();
    for (const std::size_t cell : cells_of[g]) {
      for (int k = graph.offsets[cell]; k < graph.offsets[cell + 1]; ++k) {
        const int other = group[graph.neighbours[k]];
        std::size_t& at = place[other];
        if (other == g) {
          continue;
        }
        if (at < begin || at >= coarse.neighbours.size() || coarse.neighbours[at] != other) {
          at = coarse.neighbours.size();
          coarse.neighbours.push_back(other);
          weights.neighbours.push_back(0);
        }
        ++weights.neighbours[at];
      }
    }
    coarse.offsets.push_back(static_cast<int>(coarse.neighbours.size()));
    weights.cells.push_back(static_cast<idx_t>(cells_of[g].size()));
  }
  return coarse;
}

/// Splits the graph into regions of several patches in a third of the time of bisecting the graph itself: METIS
/// coarsens the graph for each bisection, here only that of small groups of cells.
std::vector<int> split_in_regions(const CellGraph& graph, const std::vector<int>& patches) {
  int count = 0;
  const std::vector<int> group = small_groups(graph, count);
  Weights weights;
  for (const int of_region : patches) {
    weights.parts.push_back(static_cast<real_t>(of_region) /
                            static_cast<real_t>(std::accumulate(patches.begin(), patches.end(), 0)));
  }
  CellGraph groups = graph_of_groups(graph, group, count, weights);
  const std::vector<int> region_of_group =
      split(std::move(groups), std::move(weights), static_cast<int>(patches.size()), METIS_PartGraphRecursive);
  std::vector<int> region = group;
  std::for_each(region.begin(), region.end(), [&](int& of_cell) { of_cell = region_of_group[of_cell]; });
  return region;
}

}  // namespace

CellGraph graph_of(std::vector<std::vector<int>> neighbours) {
  CellGraph graph;
  for (auto& row : neighbours) {
    row = without_repeats(std::move(row));
    graph.neighbours.insert(graph.neighbours.end(), row.begin(), row.end());
    graph.offsets.push_back(static_cast<int>(graph.neighbours.size()));
  }
  return graph;
}

std::vector<int> partition_with_metis(CellGraph graph, int parts, const std::vector<double>& load) {
  Weights weights;
  if (const double whole = std::accumulate(load.begin(), load.end(), 0.0); whole > 0) {
    // In integers, 100 for the mean, but less in all than METIS can count.
    const double total = std::min(100.0 * static_cast<double>(load.size()), 5e7);
    weights.of_cell = 2;
    for (const double of_cell : load) {
      weights.cells.push_back(1);
      weights.cells.push_back(static_cast<idx_t>(total * of_cell / whole));
    }
  }
  return split(std::move(graph), std::move(weights), parts, METIS_PartGraphKway);
}

std::vector<int> split_in_patches(CellGraph graph, int patches) {
  constexpr int of_region = 16;
  const int regions = patches / of_region;
  if (regions < 2) {
    return split(std::move(graph), {}, patches, METIS_PartGraphRecursive);
  }
  std::vector<int> counts(regions, patches / regions);
  std::for_each(counts.begin(), counts.begin() + patches % regions, [](int& count) { ++count; });
  const std::vector<int> region = split_in_regions(graph, counts);
  const Incidence cells_of(region, regions);
  std::vector<int> number(region.size());  // of each cell in its region
  std::vector<int> patch(region.size());
  int first_patch = 0;
  for (int r = 0; r < regions; ++r) {
    const Incidence::Range cells = cells_of[r];
    for (PetscInt c = 0; c < cells.size(); ++c) {
      number[cells[c]] = c;
    }
    CellGraph part;
    for (const std::size_t cell : cells) {
      for (int k = graph.offsets[cell]; k < graph.offsets[cell + 1]; ++k) {
        const int neighbour = graph.neighbours[k];
        if (region[neighbour] == r) {
          part.neighbours.push_back(number[neighbour]);
        }
      }
      part.offsets.push_back(static_cast<int>(part.neighbours.size()));
    }
    const std::vector<int> patch_in_region = split(std::move(part), {}, counts[r], METIS_PartGraphRecursive);
    for (const PetscInt cell : cells) {
      patch[cell] = first_patch + patch_in_region[number[cell]];
    }
    first_patch += counts[r];
  }
  return patch;
}

std::vector<int> nested_dissection(CellGraph graph) {
  idx_t cells = graph.cells();
  std::vector<int> order(cells);
  std::vector<int> place(cells);
  if (cells == 0) {
    return place;
  }
  idx_t options[METIS_NOPTIONS];
  METIS_SetDefaultOptions(options);
  options[METIS_OPTION_SEED] = 0;
  const int status =
      METIS_NodeND(&cells, graph.offsets.data(), graph.neighbours.data(), nullptr, options, order.data(), place.data());
  if (status != METIS_OK) {
    throw Error("METIS could not order " + std::to_string(cells) + " cells");
  }
  return place;
}

}  // namespace pellicle::parallel
