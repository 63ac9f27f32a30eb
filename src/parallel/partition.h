#pragma once

#include <vector>

#include "base/namespaces.h"

namespace pellicle::parallel {

/// Graph of cells joined by their common edges, in compressed rows.
struct CellGraph {
  std::vector<int> offsets{0};  ///< (cells + 1)
  std::vector<int> neighbours;  ///< cell numbers

  int cells() const { return static_cast<int>(offsets.size()) - 1; }
};

/// Makes the graph. @param neighbours of each cell, in any order and possibly repeated
CellGraph graph_of(std::vector<std::vector<int>> neighbours);

/// Splits the graph with METIS (k-way, fixed seed). @returns the part of each cell; parts may be empty if there are
/// fewer cells than parts. Serial.
/// @param load of each cell, which is balanced like the number of cells; empty: the number alone
std::vector<int> partition_with_metis(CellGraph graph, int parts, const std::vector<double>& load = {});

/// Splits the graph into patches of about ten cells, by bisection, first into regions of several patches: for so many
/// parts this takes a quarter of the time of k-way and cuts a twentieth more edges.
std::vector<int> split_in_patches(CellGraph graph, int patches);

/// Order of elimination with little fill: METIS' nested dissection. @returns the position of each cell in the order
std::vector<int> nested_dissection(CellGraph graph);

}  // namespace pellicle::parallel
