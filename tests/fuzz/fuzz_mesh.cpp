// Every mesh reader, then check, repair and split. The first byte of an input chooses the format, the rest is the file.

#include "base/error.h"
#include "meshing/mesh_check.h"
#include "meshing/readers.h"
#include "meshing/triangulation.h"
#include "tests/fuzz/target.h"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace pellicle;
  // Those that VTK reads come last: each input takes a process of its own.
  static const char* const endings[]{".obj", ".off", ".ply", ".msh", ".stl", ".vtp", ".vtu", ".vtk"};
  const std::size_t format = size > 0 ? data[0] - std::size_t{'0'} : 8;
  if (format >= 8) {
    return -1;  // not worth keeping
  }
  expect_sound(write_input(data + 1, size - 1, endings[format]), [](const std::string& path) {
    SurfaceMesh mesh = read_mesh(path);
    check_and_repair(mesh, path);
    triangulated(mesh);
  });
  return 0;
}
