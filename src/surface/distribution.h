#pragma once

#include <algorithm>
#include <array>
#include <string>
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
class Distribution {
 public:
  /// Distributes a mesh; drops vertices without cells. Collective.
  /// @param layers of neighbours' cells, where neighbours have a vertex in common
  /// @throws Error if no row describes a corner of a cell
  Distribution(MPI_Comm comm, MeshRows rows, int layers, Numbering numbering, const SheetOptions& options);

  MPI_Comm comm() const { return comm_; }
  bool has_uv() const { return rows_.has_uv; }
  const std::vector<std::string>& fields() const { return rows_.fields; }

  PetscInt points() const { return cells() + vertex_layout_.local(); }
  PetscInt cells() const { return cell_layout_.local(); }
  bool is_owned(PetscInt point) const {
    return point < cells() ? point < cell_layout_.owned : point - cells() < vertex_layout_.owned;
  }
  const MeshRows::Point& data(PetscInt point) const {
    return point < cells() ? rows_.cells[point] : rows_.vertices[point - cells()];
  }
  MeshRows::Point& data(PetscInt point) { return const_cast<MeshRows::Point&>(std::as_const(*this).data(point)); }
  /// Gives the owners' data of all points to the ranks that have them as ghosts. Collective.
  void update_data();
  /// Values of a cell in the mesh's fields, in the order of `fields`.
  const double* field_values(PetscInt cell) const {
    return rows_.field_values.data() + static_cast<std::size_t>(cell) * rows_.fields.size();
  }
  /// The names of all groups, and the numbers of the groups of a point.
  const std::vector<std::string>& groups() const { return rows_.groups; }
  const std::vector<int>& groups_of(PetscInt point) const { return rows_.group_sets[data(point).group_set]; }
  /// The data that moved with cells.
  Records cell_data(const std::vector<PetscInt>& cells) const { return rows_.cell_data.of_items(cells); }
  /// The data that moved with particles: vertices, or the lattice points of cells.
  Records particle_data(const std::vector<PetscInt>& points) const;

  /// The vertices of a cell, in the mesh's order round it.
  template <std::size_t count>
  std::array<PetscInt, count> corners(PetscInt cell) const {
    std::array<PetscInt, count> points;
    std::copy_n(corners_.begin() + static_cast<PetscInt>(count) * cell, count, points.begin());
    return points;
  }
  /// The side that meets each side of the cells (see opposite_sides); -1 also where the cell beyond is not constrained.
  const std::vector<PetscInt>& opposite() const { return opposite_; }

  /// The pieces of the cells that this rank holds, joined by common sides and numbered by their lowest id over all
  /// ranks. Collective.
  /// @param is_closed set for each piece: no side without a neighbour
  std::vector<int> find_pieces(std::vector<bool>& is_closed) const;

  /// The numbering of the cells.
  const Layout& cell_layout() const { return cell_layout_; }
  /// A layout of points, of which the owned ones come first. Collective.
  Layout layout(const std::vector<PetscInt>& points) const;
  /// Sets the particles of a surface to cells and vertices, of which the owned ones come first. Sets everything except
  /// `is_lattice` and `cell_count`. Collective.
  void fill(Surface& set, const std::vector<PetscInt>& points) const;

 private:
  MPI_Comm comm_;
  MeshRows rows_;  ///< the cells and vertices constrained; without cell_corners and part
  Layout cell_layout_;
  Layout vertex_layout_;
  std::vector<PetscInt> corners_;   ///< vertices of the cells, as points, the same number for each
  std::vector<PetscInt> opposite_;  ///< of each side
};

/// Rest positions plus the initial noise of the options: each component is uniform in +- perturbation times
/// `mean_edge`, and depends only on seed and persistent id. @returns (3 x local) [m]. Not collective.
Eigen::Matrix3Xd perturbed_positions(const Surface& points, const SheetOptions& options, double mean_edge);

}  // namespace pellicle::surface
