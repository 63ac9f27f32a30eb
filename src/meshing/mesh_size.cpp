#include "meshing/mesh_size.h"

#include <petscsys.h>

#include <sstream>

#include "base/error.h"
#include "base/memory.h"

namespace pellicle {
inline namespace meshing {

void require_mesh_size(const std::string& what, double faces) {
  // A quad brings a vertex, ten springs and four triangles, which are numbered over all ranks.
  constexpr double most_faces = PETSC_MAX_INT / 16;
  if (!(faces <= most_faces)) {
    std::ostringstream text;
    text << what << ": " << faces << " faces, expected at most " << most_faces;
    throw Error(text.str());
  }
  // What a face takes at least until the mesh is distributed (measured: triangles 630, quads 1500 bytes). A run takes
  // several times as much, spread over the ranks.
  constexpr double bytes_of_a_face = 600;
  require_memory(what, bytes_of_a_face * faces);
}

}  // namespace meshing
}  // namespace pellicle
