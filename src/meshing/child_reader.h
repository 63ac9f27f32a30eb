#pragma once

#include <functional>
#include <string>

#include "meshing/surface_mesh.h"

namespace pellicle {
inline namespace meshing {

/// Runs a reader of a library in a child process, which hands the mesh back through a pipe. VTK's readers fail badly on
/// some malformed files (reads out of bounds, endless loops, all memory); then the child dies instead of the run, and
/// the user gets a line. The child calls neither MPI nor PETSc, and writes nothing but the pipe. Not collective.
/// @param path file that is read, which messages name
/// @param read fills points, faces, uv and face_fields; anything else that it fills is dropped
/// @throws Error as `read` does; if it ends by a signal, takes more memory than there is, or more CPU time than files
/// of this size do.
SurfaceMesh read_in_child(const std::string& path, const std::function<SurfaceMesh()>& read);

}  // namespace meshing
}  // namespace pellicle
