#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "meshing/surface_mesh.h"

namespace pellicle {
inline namespace meshing {

// One reader for each format, called by read_mesh, which has the checks common to all formats.
SurfaceMesh read_obj(const std::string& path);
SurfaceMesh read_off(const std::string& path);
SurfaceMesh read_gmsh(const std::string& path);
SurfaceMesh read_ply(const std::string& path);
SurfaceMesh read_stl(const std::string& path);
SurfaceMesh read_vtp(const std::string& path);
SurfaceMesh read_vtu(const std::string& path);
SurfaceMesh read_vtk(const std::string& path);

/// Largest number of groups of a face. Each takes memory for every face; a longer list is no list of groups.
constexpr std::size_t most_groups = 100;

/// Sorts the points and faces of the groups and removes repetitions.
void sort_groups(SurfaceMesh& mesh);

/// Adds the triangles of a strip: each point forms one with the two points before it; every other triangle is turned
/// over. Triangles with a repeated point, which connect parts of a strip, are left out.
void add_strip(SurfaceMesh& mesh, const std::vector<int>& strip);

/// Elements of a file that a surface of flat faces cannot represent.
struct LeftOut {
  int volumes = 0;       ///< volume elements, which are left out
  int higher_order = 0;  ///< faces of higher order, reduced to their corners

  /// Adds a sentence on each kind to the remarks of the mesh.
  void say(SurfaceMesh& mesh) const;
};

/// Texture coordinates of the points, given to the corners of the faces; corners that name no point get none.
std::vector<std::vector<Eigen::Vector2d>> uv_of_corners(const SurfaceMesh& mesh,
                                                        const std::vector<Eigen::Vector2d>& uv_of_points);

}  // namespace meshing
}  // namespace pellicle
