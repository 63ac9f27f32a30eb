#pragma once

#include <string>

#include "meshing/surface_mesh.h"

namespace pellicle {

/// Writes a mesh in the format of the name's ending: obj, off, ply, stl, vtp, vtu, vtk or msh (Gmsh 2.2 text).
///
/// Numbers are written in full; ply and stl, written by VTK, hold single precision; stl has triangles only, so polygons
/// are split into fans. Groups go to msh. Texture coordinates go to obj, and to vtp, vtu, vtk and ply where each point
/// has one. Not collective. @throws Error if the file cannot be written.
void write_mesh(const SurfaceMesh& mesh, const std::string& path);

}  // namespace pellicle
