#pragma once

#include <petscsys.h>

#include <array>
#include <map>
#include <string>
#include <vector>

#include "meshing/surface_mesh.h"
#include "parallel/records.h"
#include "surface/surface.h"

namespace pellicle::surface {

/// A mesh of triangles or quads whose cells and vertices are distributed over the ranks in any way: each is a row on
/// exactly one rank. Ranks may have none. Order and rank of rows have no meaning: ids connect cells and vertices.
struct MeshRows {
  /// The data of a cell or a vertex.
  struct Point {
    std::array<double, 3> position{};  ///< [m]; of a cell: of its lattice point
    std::array<double, 2> uv{};        ///< texture coordinates, if there are any
    double mass = 0;                   ///< initial mass of a sheet's particle [kg]; of a cell that of its lattice point
    PetscInt id = 0;                   ///< persistent, unique among the cells or among the vertices
    PetscInt group_set = 0;            ///< number in `group_sets`
  };

  // The same on all ranks.
  int corners = 0;  ///< of a cell
  bool has_uv = false;
  std::vector<std::string> groups;  ///< names of the groups of vertices and cells
  /// The distinct sets of groups of vertices and cells, as numbers of groups; the empty set is the first.
  std::vector<std::vector<int>> group_sets{{}};
  std::vector<std::string> fields;  ///< names of the mesh's fields of cells

  // The rows of this rank.
  std::vector<Point> cells;
  std::vector<PetscInt> cell_corners;  ///< ids of the vertices, in order round each cell
  std::vector<int> part;               ///< rank of each cell; empty on all ranks: not yet partitioned
  std::vector<double> load;            ///< work of each cell, to be balanced, too; empty on all ranks: unknown
  std::vector<double> field_values;    ///< values of `fields`, cell by cell
  std::vector<Point> vertices;

  // Further data that move with the rows: one record for each item, of the same size on all ranks, or none.
  Records cell_data;
  Records lattice_data;  ///< of the lattice particles of a sheet's cells
  Records vertex_data;
};

/// The data of a mesh about its cells and vertices, as rows of rank 0. A cell has the mean uv of its corners; a vertex
/// on a seam of the texture gets the value of its first face; ids are the numbers in the file. Collective.
/// @param mesh all cells triangles, or all quads; only rank 0's is read
MeshRows rows_of(MPI_Comm comm, const SurfaceMesh& mesh);

/// Named sets of numbers of this rank's vertices or cells.
using Groups = std::map<std::string, std::vector<PetscInt>>;

/// Sets the groups of the rows of vertices and cells. Collective.
/// @param vertices members of all groups, whose names are the same on all ranks; numbers without a row are left out
/// @param cells members of the groups that have cells
void set_groups(MPI_Comm comm, MeshRows& rows, const Groups& vertices, const Groups& cells);

/// The data of a local particle: id, rest place, texture coordinates. Not collective.
MeshRows::Point row_of(const Surface& points, PetscInt particle);

/// The first owned particles as vertices; without groups, masses and other data. Collective.
MeshRows vertex_rows(const Surface& points, PetscInt count);

}  // namespace pellicle::surface
