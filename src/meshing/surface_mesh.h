#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "base/namespaces.h"

namespace pellicle::meshing {

/// A whole polygon mesh in the memory of one rank, as read or generated, before checks and distribution. Point and face
/// numbers are those of the file; they stay the persistent ids of the run.
struct SurfaceMesh {
  std::vector<Eigen::Vector3d> points;  ///< [m]
  std::vector<std::vector<int>> faces;  ///< point numbers of each polygon, in order round it
  /// Texture coordinate of each corner of each face, empty if the mesh has none.
  std::vector<std::vector<Eigen::Vector2d>> uv;
  /// Named sets of points (Gmsh physical groups, OBJ groups), and of faces if groups have faces; ascending.
  std::map<std::string, std::vector<int>> groups;
  std::map<std::string, std::vector<int>> face_groups;
  std::map<std::string, std::vector<double>> face_fields;  ///< one number for each face, as in the file ("thickness")

  std::vector<std::string> remarks;  ///< sentences on parts of the file that were left out or changed

  /// Numbers in the file of the points and faces that a repair kept (check_and_repair); empty while all are there.
  std::vector<int> point_id;
  std::vector<int> face_id;

  /// Place of a corner of a face; corners are counted on round it [m].
  const Eigen::Vector3d& corner(std::size_t face, std::size_t k) const {
    return points[faces[face][k % faces[face].size()]];
  }
  /// Number in the file of a point or face.
  int id_of_point(int point) const { return point_id.empty() ? point : point_id[point]; }
  int id_of_face(int face) const { return face_id.empty() ? face : face_id[face]; }
};

/// Checks the size of a mesh before it is made: it must fit in this machine's memory, and its springs and triangles
/// must be fewer than the largest number. Not collective.
/// @param what name of the mesh, which begins the message: "a rectangle of 9 x 9 cells"
/// @param faces, a double so that a product of large counts does not overflow
/// @throws Error in one line
void require_mesh_size(const std::string& what, double faces);

/// Texture coordinates of the points, given to the corners of the faces; corners that name no point get none.
std::vector<std::vector<Eigen::Vector2d>> uv_of_corners(const SurfaceMesh& mesh,
                                                        const std::vector<Eigen::Vector2d>& uv_of_points);

/// Removes points, or faces, that do not represent themselves. What remains is numbered without gaps; point_id, groups,
/// uv and fields follow, and faces and groups name the representatives. Points that all are without one stay.
/// @param stands representative of each, itself or one before it; -1: none, of points that no face has
/// @returns how many were removed
int keep_points(SurfaceMesh& mesh, const std::vector<int>& stands);
int keep_faces(SurfaceMesh& mesh, const std::vector<int>& stands);

/// Merges points no further apart than `distance` [m], also through points between them, into the one of the lowest
/// number. @returns the number of removed points
/// @throws Error if so many points are so near that not all pairs can be compared
int weld(SurfaceMesh& mesh, double distance = 0);

}  // namespace pellicle::meshing
