#pragma once

#include <string>

#include "meshing/surface_mesh.h"

namespace pellicle::meshing {

/// Reads a polygon mesh, in the unit of the file; the ending of the name gives the format. Points and faces keep the
/// order of the file, polygons stay polygons.
///
/// | ending | read by | texture coordinates | groups |
/// |---|---|---|---|
/// | .obj | pellicle: VTK's reader doubles points along seams | per corner | `g` |
/// | .off | pellicle: VTK 9.1 has none | per point | - |
/// | .ply | pellicle: VTK's reader crashes on a file that ends too early | per point or corner | - |
/// | .stl | pellicle: VTK's reader refuses long names; equal points are merged | - | - |
/// | .vtp .vtu .vtk | VTK (surface cells of polygon data or unstructured grids) | per point | - |
/// | .msh | pellicle (Gmsh 2.0 to 2.2 or 4.1 as text): PETSc's reader mixes groups up | - | physical groups |
///
/// Volume elements are left out, of elements of higher order the corners are taken, and texture coordinates that some
/// corners lack are left out: SurfaceMesh::remarks say so. The arrays of one number a cell of .vtp, .vtu and .vtk files
/// become face_fields. A group holds the points of the elements that carry its name; a physical group without a name
/// goes by its number. Not collective: call it on one rank. VTK's readers run in a child process (read_in_child).
/// @throws Error on a missing or broken file, or one too large for the memory: one line that names file and fault.
SurfaceMesh read_mesh(const std::string& path);

}  // namespace pellicle::meshing
