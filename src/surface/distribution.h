#pragma once

#include <petscdmplex.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "base/handle.h"
#include "meshing/surface_mesh.h"
#include "parallel/partition.h"
#include "surface/point_set.h"
#include "surface/sheet_options.h"

namespace pellicle {

// What shells and membranes share in spreading a mesh over the ranks. Internal to mesh.

/// The side that meets each side of polygons with `count` corners each: side `count c + k` joins corners k and k + 1 of
/// polygon c. -1 where none does. At most two sides may have the same corners.
std::vector<PetscInt> opposite_sides(const std::vector<PetscInt>& corners, std::size_t count);

/// The faces of a mesh, which have the same number of corners, joined by common edges (of at most two faces).
CellGraph cell_graph(const SurfaceMesh& mesh);

/// Gives rank 0's names, or lists of numbers, to every rank. Collective.
void broadcast(MPI_Comm comm, std::vector<std::string>& names);
void broadcast(MPI_Comm comm, std::vector<std::vector<int>>& lists);

/// A mesh spread over the ranks by DMPlex. Points are what DMPlex calls so: the cells and vertices that this rank
/// holds, its own and those of the layers of cells round them. Cells come first.
class Distribution {
 public:
  /// Points [begin, end).
  struct Range {
    PetscInt begin = 0;
    PetscInt end = 0;
  };
  /// What rank 0 knows of a cell or vertex.
  struct Data {
    double position[3];  ///< [m]
    double uv[2];        ///< texture coordinates, if there are any
    double id;           ///< persistent
    double groups;       ///< of a vertex: which of the sets of groups it is in, 0: in none
  };
  /// What rank 0 knows of all cells, then of all vertices; nothing on the other ranks.
  struct Source {
    std::vector<Data> data;
    bool has_uv = false;
    /// Numbers of the groups, in the order of their names, that some vertex is in: each different set once.
    std::vector<std::vector<int>> group_sets{{}};
    Eigen::MatrixXd extra;  ///< further numbers, (any x cells + vertices)
    std::vector<int> part;  ///< rank of each cell; empty: the partitioner of the options is asked
  };

  /// What a mesh says of its cells and vertices. A cell has the mean position and uv of its corners; a vertex on a seam
  /// of the texture takes the side of its first face; ids are the numbers in the file.
  static Source source(const SurfaceMesh& mesh);

  /// Collective.
  /// @param mesh all cells triangles, or all quads; only rank 0's is read, and of it points, faces and groups
  /// @param layers of neighbours' cells, by common vertices
  Distribution(MPI_Comm comm, const SurfaceMesh& mesh, Source source, int layers, const SheetOptions& options);

  MPI_Comm comm() const { return comm_; }

  bool has_uv() const { return has_uv_; }
  PetscInt points() const { return static_cast<PetscInt>(owned_.size()); }
  Range cells() const;
  Range vertices() const;
  bool is_owned(PetscInt point) const { return owned_[static_cast<std::size_t>(point)]; }
  const Data& data(PetscInt point) const { return data_[static_cast<std::size_t>(point)]; }
  Eigen::MatrixXd::ConstColXpr extra(PetscInt point) const { return extra_.col(point); }

  /// The vertices of a cell, in the mesh's order round it.
  template <std::size_t count>
  std::array<PetscInt, count> corners(PetscInt cell) const {
    std::array<PetscInt, count> points;
    std::copy_n(corners_.begin() + static_cast<PetscInt>(count) * cell, count, points.begin());
    return points;
  }
  /// The side that meets each side of the cells (see opposite_sides); -1 also where the cell beyond is not held.
  const std::vector<PetscInt>& opposite() const { return opposite_; }

  /// Replaces the numbers at points of other ranks by their owners' numbers. Collective.
  /// @param numbers of each point, in the order of the points
  /// @param count how many each point has; the same on all ranks, also on those without points
  void fetch(std::vector<PetscInt>& numbers, int count) const;
  /// Numbers these points, of which the owned ones come first. Collective.
  Layout layout(const std::vector<PetscInt>& points) const;
  /// Makes particles of these cells and vertices, of which the owned ones come first: everything but `is_lattice` and
  /// `cell_count`. Collective.
  void fill(PointSet& set, const std::vector<PetscInt>& points) const;

 private:
  PartitionQuality quality() const;

  MPI_Comm comm_;
  Handle<DM, DMDestroy> dm_;
  bool has_uv_ = false;
  std::vector<std::string> groups_;
  std::vector<std::vector<int>> group_sets_;  ///< Source::group_sets, on every rank
  std::vector<Data> data_;                    ///< of the cells and vertices
  Eigen::MatrixXd extra_;
  std::vector<bool> owned_;
  std::vector<PetscInt> corners_;   ///< of the cells, as many for each
  std::vector<PetscInt> opposite_;  ///< of each side
};

}  // namespace pellicle
