#pragma once

#include <petscsys.h>

#include <array>
#include <string>
#include <vector>

#include "meshing/surface_mesh.h"
#include "parallel/records.h"
#include "surface/surface.h"

namespace pellicle {
inline namespace surface {

/// A mesh of triangles or quads whose cells and vertices lie on the ranks in any way: each is a row on exactly one
/// rank. Ranks may have none. Order and place of the rows mean nothing: ids say what belongs together.
struct MeshRows {
  /// What is known of a cell or a vertex.
  struct Point {
    std::array<double, 3> position{};  ///< [m]; of a cell: of its lattice point, see make_sheet
    std::array<double, 2> uv{};        ///< texture coordinates, if there are any
    double mass = 0;                   ///< initial mass of a sheet's particle [kg]; of a cell as its position
    PetscInt id = 0;                   ///< persistent, unique among the cells or among the vertices
    PetscInt group_set = 0;            ///< of a vertex: which of `group_sets` it is in
  };

  // The same on all ranks.
  int corners = 0;  ///< of a cell
  bool has_uv = false;
  std::vector<std::string> groups;  ///< names of the groups of vertices
  /// Numbers of the groups that some vertex is in: each different set once, and the empty one first.
  std::vector<std::vector<int>> group_sets{{}};
  std::vector<std::string> fields;  ///< names of the numbers that the mesh has for each cell

  // The rows of this rank.
  std::vector<Point> cells;
  std::vector<PetscInt> cell_corners;  ///< ids of the vertices, in order round each cell
  std::vector<int> part;               ///< rank to which each cell belongs; empty on all ranks: to be found
  std::vector<double> field_values;    ///< of each cell those of `fields`
  std::vector<Point> vertices;

  // What moves with them without being looked at, of as many bytes on all ranks: one an item, or of no bytes.
  Records cell_data;
  Records lattice_data;  ///< of a sheet's cell: what moves with the lattice particle
  Records vertex_data;
};

/// What a mesh says of its cells and vertices, as rows of rank 0. A cell has the mean uv of its corners; a vertex on a
/// seam of the texture takes the side of its first face; ids are the numbers in the file. Collective.
/// @param mesh all cells triangles, or all quads; only rank 0's is read
MeshRows rows_of(MPI_Comm comm, const SurfaceMesh& mesh);

/// Sets the groups that vertices are in. Collective.
/// @param names of the groups, the same on all ranks
/// @param groups_of_vertex numbers of the groups of each vertex of this rank, in ascending order
void set_groups(MPI_Comm comm, MeshRows& rows, std::vector<std::string> names,
                const std::vector<std::vector<int>>& groups_of_vertex);

/// What is known of a local particle: id, rest place, texture coordinates. Not collective.
MeshRows::Point row_of(const Surface& points, PetscInt particle);

/// The first owned particles as vertices, with their groups; without masses and data. Collective.
MeshRows vertex_rows(const Surface& points, PetscInt count);

}  // namespace surface
}  // namespace pellicle
