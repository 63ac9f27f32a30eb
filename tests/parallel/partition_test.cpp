#include "parallel/partition.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace pellicle {
namespace {

/// Cells of a grid, joined by their sides.
CellGraph grid_graph(int nx, int ny) {
  CellGraph graph;
  for (int j = 0; j < ny; ++j) {
    for (int i = 0; i < nx; ++i) {
      const int cell = j * nx + i;
      if (j > 0) {
        graph.neighbours.push_back(cell - nx);
      }
      if (i > 0) {
        graph.neighbours.push_back(cell - 1);
      }
      if (i + 1 < nx) {
        graph.neighbours.push_back(cell + 1);
      }
      if (j + 1 < ny) {
        graph.neighbours.push_back(cell + nx);
      }
      graph.offsets.push_back(static_cast<int>(graph.neighbours.size()));
    }
  }
  return graph;
}

/// Edges between cells of different patches.
int cut(const CellGraph& graph, const std::vector<int>& patch) {
  int sum = 0;
  for (std::size_t cell = 0; cell < patch.size(); ++cell) {
    for (int k = graph.offsets[cell]; k < graph.offsets[cell + 1]; ++k) {
      sum += patch[cell] != patch[graph.neighbours[k]] ? 1 : 0;
    }
  }
  return sum / 2;
}

TEST(Parts, HaveEvenSharesOfCellsAndOfALoad) {
  constexpr int nx = 40;
  constexpr int ny = 30;
  const CellGraph graph = grid_graph(nx, ny);
  std::vector<double> load;  // a third of the cells has nearly all of it
  for (int cell = 0; cell < nx * ny; ++cell) {
    load.push_back(cell % nx < nx / 3 ? 7 : 0.1);
  }
  const double whole = std::accumulate(load.begin(), load.end(), 0.0);
  for (const int parts : {2, 3, 4}) {
    const std::vector<int> part = partition_with_metis(graph, parts, load);
    std::vector<double> cells(parts, 0);
    std::vector<double> loads = cells;
    for (std::size_t cell = 0; cell < part.size(); ++cell) {
      ++cells.at(static_cast<std::size_t>(part[cell]));
      loads.at(static_cast<std::size_t>(part[cell])) += load[cell];
    }
    EXPECT_LT(*std::max_element(cells.begin(), cells.end()) * parts, 1.05 * nx * ny) << parts;
    EXPECT_LT(*std::max_element(loads.begin(), loads.end()) * parts, 1.05 * whole) << parts;
  }
}

TEST(Patches, AreOfLikeSizeAndCompact) {
  for (const int patches : {1, 7, 31, 32, 100, 157}) {
    const CellGraph graph = grid_graph(101, 99);
    const std::vector<int> patch = split_in_patches(graph, patches);
    ASSERT_EQ(patch.size(), 9999u);
    std::vector<int> size(patches, 0);
    for (const int p : patch) {
      ++size.at(static_cast<std::size_t>(p));
    }
    const double mean = 9999.0 / patches;
    EXPECT_GT(*std::min_element(size.begin(), size.end()), 0.9 * mean) << patches;
    EXPECT_LT(*std::max_element(size.begin(), size.end()), 1.1 * mean) << patches;
    // Squares have four sides of sqrt(mean) cells, each beside another square but at the edge.
    const double squares = 2 * patches * std::sqrt(mean) - 200;
    EXPECT_LT(cut(graph, patch), std::max(1.2 * squares, 1.0)) << patches;
  }
}

}  // namespace
}  // namespace pellicle
