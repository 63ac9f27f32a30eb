#pragma once

#include <vector>

namespace pellicle {
inline namespace parallel {

/// Graph of cells joined by their common edges, in compressed rows.
struct CellGraph {
  std::vector<int> offsets;     ///< (cells + 1)
  std::vector<int> neighbours;  ///< cell numbers

  int cells() const { return static_cast<int>(offsets.size()) - 1; }
};

/// @param neighbours of each cell, in any order and several times
CellGraph graph_of(std::vector<std::vector<int>> neighbours);

/// Splits the graph with METIS (k-way, fixed seed). @returns the part of each cell; parts may be empty when there are
/// fewer cells than parts. Serial.
/// @param load of each cell, of which parts are to have as equal shares as of cells; empty: nothing else counts
std::vector<int> partition_with_metis(CellGraph graph, int parts, const std::vector<double>& load = {});

/// The same for patches of about ten cells, by bisection, first into regions of several patches: for so many parts this
/// takes a quarter of the time and cuts a twentieth more edges.
std::vector<int> split_in_patches(CellGraph graph, int patches);

/// Order of elimination with little fill: METIS' nested dissection. @returns the place of each cell in it
std::vector<int> nested_dissection(CellGraph graph);

}  // namespace parallel
}  // namespace pellicle
