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

/// Splits the graph with METIS (k-way, fixed seed). @returns the part of each cell; parts may be empty when there are
/// fewer cells than parts. Serial.
std::vector<int> partition_with_metis(CellGraph graph, int parts);

}  // namespace parallel
}  // namespace pellicle
