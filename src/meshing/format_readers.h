#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "meshing/surface_mesh.h"

namespace pellicle {
inline namespace meshing {

// One reader for each format; read_mesh, which calls them, checks what all formats have in common (see there).
SurfaceMesh read_obj(const std::string& path);
SurfaceMesh read_off(const std::string& path);
SurfaceMesh read_gmsh(const std::string& path);
SurfaceMesh read_ply(const std::string& path);
SurfaceMesh read_stl(const std::string& path);
SurfaceMesh read_vtp(const std::string& path);
SurfaceMesh read_vtu(const std::string& path);
SurfaceMesh read_vtk(const std::string& path);

/// Most groups of one face. Each takes memory for every face of it; a longer list is not a list of groups.
constexpr std::size_t most_groups = 100;

/// Sorts the points and faces of the groups, each of which then occurs once.
void sort_groups(SurfaceMesh& mesh);

/// Adds the triangles of a strip: each of its points is a corner of one whose others are the two points before it;
/// every other triangle is turned over. Triangles that name a point twice only lead from one part of a strip to the
/// next.
void add_strip(SurfaceMesh& mesh, const std::vector<int>& strip);

/// Elements of a file that a surface of flat faces has no place for.
struct LeftOut {
  int volumes = 0;       ///< that are left out
  int higher_order = 0;  ///< faces of which only the corners are taken

  /// Adds a sentence on each kind to the remarks of the mesh.
  void say(SurfaceMesh& mesh) const;
};

/// Texture coordinates of the points, given to the corners of the faces; corners that name no point get none.
std::vector<std::vector<Eigen::Vector2d>> uv_of_corners(const SurfaceMesh& mesh,
                                                        const std::vector<Eigen::Vector2d>& uv_of_points);

}  // namespace meshing
}  // namespace pellicle
