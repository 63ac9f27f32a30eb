#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "mesh/surface_mesh.h"

namespace pellicle {

// One reader a format, behind read_mesh, which checks what all have in common (see there).
SurfaceMesh read_obj(const std::string& path);
SurfaceMesh read_off(const std::string& path);
SurfaceMesh read_gmsh(const std::string& path);
SurfaceMesh read_ply(const std::string& path);
SurfaceMesh read_stl(const std::string& path);
SurfaceMesh read_vtp(const std::string& path);
SurfaceMesh read_vtu(const std::string& path);
SurfaceMesh read_vtk(const std::string& path);

/// Texture coordinates of the points, given to the corners of the faces; corners that name no point get none.
std::vector<std::vector<Eigen::Vector2d>> uv_of_corners(const SurfaceMesh& mesh,
                                                        const std::vector<Eigen::Vector2d>& uv_of_points);

}  // namespace pellicle
