#pragma once

#include <string>

namespace pellicle {
inline namespace meshing {

/// Refuses a mesh that would be too large before any of it is made: one that does not fit in this machine's memory, or
/// that has more faces than springs and triangles can be numbered for. Not collective.
/// @param what begins the message: "a rectangle of 9 x 9 cells"
/// @param faces, a double so that a product of large counts does not overflow
/// @throws Error in one line
void require_mesh_size(const std::string& what, double faces);

}  // namespace meshing
}  // namespace pellicle
