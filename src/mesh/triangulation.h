#pragma once

#include "mesh/surface_mesh.h"

namespace pellicle {

/// The mesh in triangles: quads split along their shorter diagonal, larger polygons by VTK. A mesh of triangles stays
/// as it is, ids included; otherwise the triangles are numbered anew in the order of their faces, each with the
/// corners' texture coordinates and the fields of its face. Points keep their ids. Not collective.
/// @throws Error that names a polygon that cannot be split.
SurfaceMesh triangulated(const SurfaceMesh& mesh);

/// Volume that a closed mesh encloses, positive with normals outward [m^3]. Faces that are not flat count as
/// triangulated splits them. Not collective.
double enclosed_volume(const SurfaceMesh& mesh);

}  // namespace pellicle
