#pragma once

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "parallel/layout.h"
#include "parallel/partition.h"
#include "surface/mesh_rows.h"
#include "surface/sheet_options.h"
#include "surface/surface.h"

namespace pellicle::surface {

// Distribution of a mesh over the ranks, for shells and membranes. Internal to surface.

/// Order in which a rank numbers its owned cells and their vertices.
enum class Numbering {
  by_nearness,            ///< along fronts (reverse Cuthill-McKee): near on the surface is near in memory
  by_id_unless_scattered  ///< by ids; by nearness if ids put the vertices of cells far from each other
};

/// A mesh distributed over the ranks. Its points are the cells and vertices that this rank holds, its own and those of
/// the layers of cells round them: cells before vertices, and owned before others.
///
/// A vertex belongs to the last rank that owns a cell at it. All numbers depend only on the cells, their ids and their
/// ranks, and not on where the rows were before.
struct Distribution {
  /// Distributes a mesh; drops vertices without cells. Collective.
  /// @param layers of neighbours' cells, where neighbours have a vertex in common
  /// @throws Error if no row describes a corner of a cell
  Distribution(MPI_Comm comm, MeshRows given, int layers, Numbering numbering, const SheetOptions& options);

  MeshRows rows;         ///< the cells and vertices constrained; without cell_corners and part
  Layout cell_layout;    ///< the numbering of the cells
  Layout vertex_layout;  ///< the numbering of the vertices
  /// The side that meets each side of the cells (see opposite_sides); -1 also where the cell beyond is not constrained.
  std::vector<PetscInt> opposite;
  std::vector<PetscInt> cell_vertices;  ///< vertices of the cells, as points, the same number for each

  MPI_Comm comm() const { return cell_layout.comm; }
  PetscInt points() const { return cells() + vertex_layout.local(); }
  PetscInt cells() const { return cell_layout.local(); }
  bool is_owned(PetscInt point) const {
    return point < cells() ? point < cell_layout.owned : point - cells() < vertex_layout.owned;
  }
  const MeshRows::Point& data(PetscInt point) const {
    return point < cells() ? rows.cells[point] : rows.vertices[point - cells()];
  }
  MeshRows::Point& data(PetscInt point) { return const_cast<MeshRows::Point&>(std::as_const(*this).data(point)); }
  /// The numbers of the groups of a point.
  const std::vector<int>& groups_of(PetscInt point) const { return rows.group_sets[data(point).group_set]; }
  /// The data that moved with particles: vertices, or the lattice points of cells.
  Records particle_data(const std::vector<PetscInt>& points) const;

  /// The vertices of a cell, in the mesh's order round it.
  template <std::size_t count>
  std::array<PetscInt, count> corners(PetscInt cell) const {
    std::array<PetscInt, count> points;
    std::copy_n(cell_vertices.begin() + static_cast<PetscInt>(count) * cell, count, points.begin());
    return points;
  }

  /// The pieces of the cells that this rank holds, joined by common sides and numbered by their lowest id over all
  /// ranks. Collective.
  /// @param is_closed set for each piece: no side without a neighbour
  std::vector<int> find_pieces(std::vector<bool>& is_closed) const;

  /// A layout of points, of which the owned ones come first. Collective.
  Layout layout(const std::vector<PetscInt>& points) const;
  /// Sets the particles of a surface to cells and vertices, of which the owned ones come first. Sets everything except
  /// `is_lattice` and `cell_count`. Collective.
  void fill(Surface& set, const std::vector<PetscInt>& points) const;
};

/// Rest positions plus the initial noise of the options: each component is uniform in +- perturbation times
/// `mean_edge`, and depends only on seed and persistent id. @returns (3 x local) [m]. Not collective.
Eigen::Matrix3Xd perturbed_positions(const Surface& points, const SheetOptions& options, double mean_edge);

}  // namespace pellicle::surface
