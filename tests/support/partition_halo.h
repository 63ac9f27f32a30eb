#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

#include "base/incidence.h"
#include "parallel/partition.h"
#include "surface/shell.h"

namespace pellicle {

/// What a part of a sheet's cells holds and sends: what Distribution would give the rank that has it.
struct PartHalo {
  PetscInt cells = 0;       ///< owned
  PetscInt particles = 0;   ///< owned: corners and lattice points
  PetscInt ghosts = 0;      ///< particles of other parts that it holds
  PetscInt sent = 0;        ///< ghosts that other parts hold of its particles
  PetscInt neighbours = 0;  ///< parts that it has ghosts of
  PetscInt receivers = 0;   ///< parts that have ghosts of it
};

/// The cells of a mesh, in compressed rows of the vertices.
class CellsOfVertices {
 public:
  CellsOfVertices(const std::vector<PetscInt>& corners, std::size_t count)
      : offsets_(static_cast<std::size_t>(*std::max_element(corners.begin(), corners.end())) + 2, 0),
        cells_(corners.size()) {
    for (const PetscInt vertex : corners) {
      ++offsets_[static_cast<std::size_t>(vertex) + 1];
    }
    std::partial_sum(offsets_.begin(), offsets_.end(), offsets_.begin());
    std::vector<std::size_t> next(offsets_.begin(), offsets_.end() - 1);
    for (std::size_t i = 0; i < corners.size(); ++i) {
      cells_[next[corners[i]]++] = static_cast<PetscInt>(i / count);
    }
  }
  std::size_t vertices() const { return offsets_.size() - 1; }
  const PetscInt* begin(PetscInt vertex) const { return cells_.data() + offsets_[vertex]; }
  const PetscInt* end(PetscInt vertex) const { return cells_.data() + offsets_[static_cast<std::size_t>(vertex) + 1]; }

 private:
  std::vector<std::size_t> offsets_;
  std::vector<PetscInt> cells_;
};

/// The graph of quads that METIS splits.
inline CellGraph graph_of_quads(const std::vector<PetscInt>& corners) {
  const std::vector<PetscInt> opposite = opposite_sides(corners, 4);
  CellGraph graph;
  for (std::size_t side = 0; side < opposite.size(); ++side) {
    if (opposite[side] >= 0) {
      graph.neighbours.push_back(opposite[side] / 4);
    }
    if (side % 4 == 3) {
      graph.offsets.push_back(static_cast<int>(graph.neighbours.size()));
    }
  }
  return graph;
}

/// Of each part of a sheet of quads what it holds, without ranks to hold it. As in Distribution, a vertex belongs to
/// the last part with a cell at it, and a part holds `shell_layers` of cells round its own.
/// @param corners of the cells, four each @param part of each cell, below `parts`
inline std::vector<PartHalo> halos_of_sheet(const std::vector<PetscInt>& corners, const std::vector<int>& part,
                                            int parts) {
  const CellsOfVertices cells_of(corners, 4);
  std::vector<int> owner(cells_of.vertices(), -1);
  std::vector<std::vector<PetscInt>> own_cells(parts);
  for (std::size_t cell = 0; cell < part.size(); ++cell) {
    own_cells[part[cell]].push_back(static_cast<PetscInt>(cell));
    for (std::size_t i = 4 * cell; i < 4 * cell + 4; ++i) {
      int& last = owner[corners[i]];
      last = std::max(last, part[cell]);
    }
  }
  std::vector<PartHalo> halos(parts);
  for (const int p : owner) {
    halos[p].particles += p >= 0 ? 1 : 0;
  }
  std::vector<int> holder_of_cell(part.size(), -1);  // the last part that was seen to hold it
  std::vector<int> holder_of_vertex(cells_of.vertices(), -1);
  for (int p = 0; p < parts; ++p) {
    PartHalo& halo = halos[p];
    std::vector<PetscInt> front = own_cells[p];
    halo.cells = static_cast<PetscInt>(front.size());
    halo.particles += halo.cells;
    std::vector<int> owners_of_ghosts;
    std::vector<PetscInt> constrained;  // vertices that the last layer has brought
    const auto take_vertices = [&] {
      constrained.clear();
      for (const PetscInt cell : front) {
        for (auto i = 4 * static_cast<std::size_t>(cell); i < 4 * static_cast<std::size_t>(cell) + 4; ++i) {
          const auto vertex = static_cast<std::size_t>(corners[i]);
          if (std::exchange(holder_of_vertex[vertex], p) != p) {
            constrained.push_back(corners[i]);
            if (owner[vertex] != p) {
              owners_of_ghosts.push_back(owner[vertex]);
            }
          }
        }
      }
    };
    for (const PetscInt cell : front) {
      holder_of_cell[cell] = p;
    }
    take_vertices();
    for (int layer = 0; layer < shell_layers; ++layer) {
      front.clear();
      for (const PetscInt vertex : constrained) {
        for (const PetscInt* cell = cells_of.begin(vertex); cell != cells_of.end(vertex); ++cell) {
          if (std::exchange(holder_of_cell[*cell], p) != p) {
            front.push_back(*cell);
            owners_of_ghosts.push_back(part[*cell]);
          }
        }
      }
      take_vertices();
    }
    halo.ghosts = static_cast<PetscInt>(owners_of_ghosts.size());
    for (const int other : owners_of_ghosts) {
      ++halos[other].sent;
    }
    std::sort(owners_of_ghosts.begin(), owners_of_ghosts.end());
    owners_of_ghosts.erase(std::unique(owners_of_ghosts.begin(), owners_of_ghosts.end()), owners_of_ghosts.end());
    halo.neighbours = static_cast<PetscInt>(owners_of_ghosts.size());
    for (const int other : owners_of_ghosts) {
      ++halos[other].receivers;
    }
  }
  return halos;
}

}  // namespace pellicle
