#pragma once

#include <string>

#include "mesh/surface_mesh.h"

namespace pellicle {

/// Reads a polygon mesh, in the unit of the file; the ending of the name gives the format. Points and faces keep the
/// order of the file (Gmsh: triangles before quads), polygons stay polygons.
///
/// | ending | read by | texture coordinates | groups |
/// |---|---|---|---|
/// | .obj | pellicle: VTK's reader doubles points along seams | per corner | `g` |
/// | .off | pellicle: VTK 9.1 has none | - | - |
/// | .ply | VTK | per point | - |
/// | .stl | VTK; equal points are merged, for the format has no shared points | - | - |
/// | .vtp .vtu .vtk | VTK (surface cells of polygon data or unstructured grids) | per point | - |
/// | .msh | PETSc (Gmsh 2.2 to 4.1, text or binary) | - | physical groups |
///
/// A group holds the points of the elements that carry its name. Not collective: call it on one rank.
/// @throws Error on a missing or broken file: one line that names the file and the fault.
SurfaceMesh read_mesh(const std::string& path);

}  // namespace pellicle
