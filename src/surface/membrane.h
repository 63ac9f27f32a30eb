#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <string>
#include <vector>

#include "surface/mesh_rows.h"
#include "surface/sheet_options.h"
#include "surface/split_corners.h"
#include "surface/surface.h"

namespace pellicle::surface {

/// A distributed triangle mesh: the middle surface of a balloon, as flat arrays. Its particles are the vertices.
///
/// Local elements: the triangles of this rank, then those of other ranks with a vertex that this rank owns. So a rank
/// sums all forces on its vertices without communication. All vertices of local elements are local.
struct Membrane : Surface {
  Eigen::Matrix2Xd element_uv;  ///< mean of the texture coordinates of the corners of each local element, or no columns
  std::map<std::string, std::vector<double>> element_fields;  ///< SurfaceMesh::face_fields of the local elements
  Groups element_groups;  ///< local elements of groups, ascending; groups without any are left out
};

/// A membrane with the data of its particles and elements.
struct LoadedMembrane {
  Membrane membrane;
  Records particles;  ///< of the local particles, ghosts up to date
  Records elements;   ///< of the local elements, ghosts up to date
};

/// Builds a membrane from rows that are distributed over the ranks in any way. Its numbers depend only on the
/// triangles, their ids and their ranks. Collective.
LoadedMembrane make_membrane(MPI_Comm comm, MeshRows rows, const SheetOptions& options);

/// Distributes a triangle mesh over the ranks of `comm`, with one layer of overlap. Vertices and elements that are near
/// each other on the surface get near numbers on a rank, whatever the order of the file; persistent ids are the file's.
/// Collective.
/// @param mesh checked triangles (see triangulated); only rank 0's is read
inline Membrane make_membrane(MPI_Comm comm, const SurfaceMesh& mesh, const SheetOptions& options) {
  return make_membrane(comm, rows_of(comm, mesh), options).membrane;
}

/// Sets the data of a membrane for burning: masses and edges. Collective.
/// @param element_mass of the local elements [kg]
void set_burnable(Membrane& membrane, std::vector<double> element_mass);

/// Undeformed area round each local vertex: a third of the triangles at it [m^2]. Collective.
std::vector<double> vertex_areas(const Membrane& membrane);

/// The membrane as rows: elements and vertices on the ranks that own them. Collective.
/// @param particles data of the owned particles
/// @param elements data of the owned elements
MeshRows rows_of(const Membrane& membrane, const Records& particles, const Records& elements);

/// Splits corners, as of a sheet (surface/shell.h). Collective.
LoadedMembrane split(const Membrane& membrane, const SplitCorners& corners, const Records& particles,
                     const Records& copies, const Records& elements, const SheetOptions& options);

/// Rest positions plus the initial noise, whose unit is the mean side of the triangles (surface/distribution.h).
/// Collective.
/// @returns (3 x local) [m]
Eigen::Matrix3Xd perturbed_positions(const Membrane& membrane, const SheetOptions& options);

/// Two edges of a triangle, from its first corner [m].
struct Edges {
  Eigen::Vector3d e12;
  Eigen::Vector3d e13;
};

/// @param positions of the local vertices, (3 x local) [m]
inline Edges edges_of(const double* positions, const std::array<PetscInt, 3>& triangle) {
  using Position = Eigen::Map<const Eigen::Vector3d>;
  const Position x1(positions + 3 * triangle[0]);
  return {Position(positions + 3 * triangle[1]) - x1, Position(positions + 3 * triangle[2]) - x1};
}

}  // namespace pellicle::surface
