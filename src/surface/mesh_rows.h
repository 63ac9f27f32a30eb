#pragma once

#include <petscsys.h>

#include <array>
#include <map>
#include <string>
#include <vector>

#include "meshing/surface_mesh.h"
#include "parallel/records.h"
#include "surface/surface.h"

namespace pellicle {
inline namespace surface {

/// A mesh of triangles or quads whose cells and vertices are distributed over the ranks in any way: each is a row on
/// exactly one rank. Ranks may have none. Order and place of the rows have no meaning: ids say what belongs together.
struct MeshRows {
  /// The data of a cell or a vertex.
  struct Point {
    std::array<double, 3> position{};  ///< [m]; of a cell: of its lattice point, see make_sheet
    std::array<double, 2> uv{};        ///< texture coordinates, if there are any
    double mass = 0;                   ///< initial mass of a sheet's particle [kg]; of a cell that of its lattice point
    PetscInt id = 0;                   ///< persistent, unique among the cells or among the vertices
    PetscInt group_set = 0;            ///< which of `group_sets` it is in
  };

  // The same on all ranks.
  int corners = 0;  ///< of a cell
  bool has_uv = false;
  std::vector<std::string> groups;  ///< names of the groups of vertices and cells
  /// Numbers of the groups that some vertex or cell is in: each different set once, and the empty one first.
  std::vector<std::vector<int>> group_sets{{}};
  std::vector<std::string> fields;  ///< names of the numbers that the mesh has for each cell

  // The rows of this rank.
  std::vector<Point> cells;
  std::vector<PetscInt> cell_corners;  ///< ids of the vertices, in order round each cell
  std::vector<int> part;               ///< rank to which each cell belongs; empty on all ranks: not decided yet
  std::vector<double> load;            ///< work of each cell, to be shared evenly, too; empty on all ranks: unknown
  std::vector<double> field_values;    ///< of each cell those of `fields`
  std::vector<Point> vertices;

  // Data that move with them without being interpreted: one record for each item, of the same size on all ranks, or
  // none.
  Records cell_data;
  Records lattice_data;  ///< of a sheet's cell: data that move with the lattice particle
  Records vertex_data;
};

/// The data of a mesh about its cells and vertices, as rows of rank 0. A cell has the mean uv of its corners; a vertex
/// on a seam of the texture gets the value of its first face; ids are the numbers in the file. Collective.
/// @param mesh all cells triangles, or all quads; only rank 0's is read
MeshRows rows_of(MPI_Comm comm, const SurfaceMesh& mesh);

/// Named sets of numbers of this rank's vertices or cells.
using Groups = std::map<std::string, std::vector<PetscInt>>;

/// Sets the groups that the rows of vertices and cells are in. Collective.
/// @param vertices members of all groups, whose names are the same on all ranks; numbers without a row are left out
/// @param cells the same of groups that have cells
void set_groups(MPI_Comm comm, MeshRows& rows, const Groups& vertices, const Groups& cells);

/// The data of a local particle: id, rest place, texture coordinates. Not collective.
MeshRows::Point row_of(const Surface& points, PetscInt particle);

/// The first owned particles as vertices; without groups, masses and other data. Collective.
MeshRows vertex_rows(const Surface& points, PetscInt count);

}  // namespace surface
}  // namespace pellicle
