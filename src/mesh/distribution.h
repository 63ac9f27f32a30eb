#pragma once

#include <petscdmplex.h>

#include <Eigen/Core>
#include <array>
#include <string>
#include <unordered_map>
#include <vector>

#include "base/handle.h"
#include "mesh/partition.h"
#include "mesh/point_set.h"
#include "mesh/sheet_options.h"
#include "mesh/surface_mesh.h"

namespace pellicle {

// What shells and membranes share in spreading a mesh over the ranks. Internal to mesh.

/// The faces of a mesh joined by common edges (of at most two faces).
CellGraph cell_graph(const SurfaceMesh& mesh);

/// Gives rank 0's names to every rank. Collective.
void broadcast(MPI_Comm comm, std::vector<std::string>& names);

/// Sets a layout's owned, first and global numbers. Collective.
void number_owned(Layout& layout, MPI_Comm comm, PetscInt owned);

/// A mesh spread over the ranks by DMPlex. Points are what DMPlex calls so: the cells, vertices and edges that this
/// rank holds, its own and those of the layers of cells round them.
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
    double vertices[4];  ///< numbers in the mesh: of a cell its corners, of a vertex [0] itself
  };
  /// What rank 0 knows of all cells, then of all vertices; nothing on the other ranks.
  struct Source {
    std::vector<Data> data;
    bool has_uv = false;
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

  DM dm() const { return dm_; }
  bool has_uv() const { return has_uv_; }
  PetscInt points() const { return static_cast<PetscInt>(owned_.size()); }
  Range cells() const;
  Range vertices() const;
  Range edges() const;
  bool is_owned(PetscInt point) const { return owned_[static_cast<std::size_t>(point)]; }
  const Data& data(PetscInt point) const { return data_[static_cast<std::size_t>(point)]; }
  Eigen::MatrixXd::ConstColXpr extra(PetscInt point) const { return extra_.col(point); }

  /// The vertices of a cell, in the mesh's order round it.
  template <std::size_t count>
  std::array<PetscInt, count> corners(PetscInt cell) const {
    std::array<PetscInt, count> points;
    for (std::size_t k = 0; k < count; ++k) {
      points[k] = point_of_vertex_.at(static_cast<PetscInt>(data(cell).vertices[k]));
    }
    return points;
  }

  /// Replaces the numbers at points of other ranks by their owners' numbers. @param numbers of all points. Collective.
  void fetch(std::vector<PetscInt>& numbers) const;
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
  std::vector<Data> data_;  ///< of the cells and vertices
  Eigen::MatrixXd extra_;
  std::vector<std::vector<PetscInt>> group_members_;  ///< for each group: 1 where the point belongs to it
  std::vector<bool> owned_;
  std::unordered_map<PetscInt, PetscInt> point_of_vertex_;  ///< by number in the mesh
};

}  // namespace pellicle
