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

/// Sorts the points of the groups, each of which then occurs once.
void sort_groups(SurfaceMesh& mesh);

/// Texture coordinates of the points, given to the corners of the faces; corners that name no point get none.
std::vector<std::vector<Eigen::Vector2d>> uv_of_corners(const SurfaceMesh& mesh,
                                                        const std::vector<Eigen::Vector2d>& uv_of_points);

}  // namespace meshing
}  // namespace pellicle
