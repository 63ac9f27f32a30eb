#pragma once

#include <string>

namespace pellicle {
inline namespace meshing {

/// Checks the size of a mesh before it is made: it must fit in this machine's memory, and its springs and triangles
/// must be fewer than the largest number. Not collective.
/// @param what name of the mesh, which begins the message: "a rectangle of 9 x 9 cells"
/// @param faces, a double so that a product of large counts does not overflow
/// @throws Error in one line
void require_mesh_size(const std::string& what, double faces);

}  // namespace meshing
}  // namespace pellicle
