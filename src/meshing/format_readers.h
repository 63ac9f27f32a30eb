#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "meshing/surface_mesh.h"

namespace pellicle::meshing {

// One reader for each format, called by read_mesh, which has the checks common to all formats.
SurfaceMesh read_obj(const std::string& path);
SurfaceMesh read_off(const std::string& path);
SurfaceMesh read_gmsh(const std::string& path);
SurfaceMesh read_ply(const std::string& path);
SurfaceMesh read_stl(const std::string& path);
SurfaceMesh read_vtp(const std::string& path);
SurfaceMesh read_vtu(const std::string& path);
SurfaceMesh read_vtk(const std::string& path);

/// Runs a library's reader in a child process, which returns the mesh through a file in memory. VTK's readers fail
/// badly on some malformed files (reads out of bounds, endless loops, all memory); then the child dies instead of the
/// run, and the user gets a message. The child calls neither MPI nor PETSc, and writes to nothing but this file. Not
/// collective.
/// @param path of the file, for messages
/// @param read fills points, faces, uv and face_fields; everything else is dropped
/// @throws Error as `read` does, and if the child ends by a signal, or takes too much memory or CPU time for a file of
/// this size.
SurfaceMesh read_in_child(const std::string& path, const std::function<SurfaceMesh()>& read);

/// Largest number of groups of a face. Each takes memory for every face; a longer list is no list of groups.
constexpr std::size_t most_groups = 100;

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

}  // namespace pellicle::meshing
