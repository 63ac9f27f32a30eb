#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "meshing/surface_mesh.h"

namespace pellicle::meshing {

/// Triangles of a face, as numbers of its corners: a quad is split along its shorter diagonal, a larger polygon by
/// cut_ears. None if a polygon cannot be split.
std::vector<std::array<std::size_t, 3>> split_face(const SurfaceMesh& mesh, std::size_t face);

/// The mesh with faces split into triangles (split_face). A mesh of triangles is not changed, ids included; otherwise
/// the triangles are numbered anew in the order of their faces, each with the corners' texture coordinates and the
/// fields of its face. Points keep their ids. Not collective.
/// @throws Error that names a polygon that cannot be split.
SurfaceMesh triangulated(const SurfaceMesh& mesh);

/// Volume that a closed mesh encloses, positive with normals outward [m^3]. Warped faces are taken as split by
/// `triangulated`. Not collective.
double enclosed_volume(const SurfaceMesh& mesh);

}  // namespace pellicle::meshing
