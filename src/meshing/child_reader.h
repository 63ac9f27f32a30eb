#pragma once

#include <functional>
#include <string>

#include "meshing/surface_mesh.h"

namespace pellicle {
inline namespace meshing {

/// Runs a library's reader in a child process, which returns the mesh through a pipe. VTK's readers fail badly on some
/// malformed files (reads out of bounds, endless loops, all memory); then the child dies instead of the run, and the
/// user gets a message. The child calls neither MPI nor PETSc, and writes to nothing but the pipe. Not collective.
/// @param path of the file, for messages
/// @param read fills points, faces, uv and face_fields; everything else is dropped
/// @throws Error as `read` does, and if the child ends by a signal, or takes too much memory or CPU time for a file of
/// this size.
SurfaceMesh read_in_child(const std::string& path, const std::function<SurfaceMesh()>& read);

}  // namespace meshing
}  // namespace pellicle
