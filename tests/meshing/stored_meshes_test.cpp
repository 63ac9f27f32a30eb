// meshes/ holds what our own generators wrote, a mesh for each reader and one for a deck. To write them anew:
//   PELLICLE_WRITE_MESHES=1 build/release/tests/test_mesh --gtest_filter='StoredMeshes.*'

#include <gtest/gtest.h>

#include <cstdlib>

#include "meshing/generators.h"
#include "meshing/mesh_check.h"
#include "meshing/readers.h"
#include "tests/meshing/mesh_writers.h"

namespace pellicle {
namespace {

struct StoredMesh {
  const char* file;
  SurfaceMesh mesh;
};

std::vector<StoredMesh> stored_meshes() {
  const SurfaceMesh sheet = rectangle_mesh({16, 12}, {0.4, 0.3});
  return {{"torus.obj", torus_mesh({24, 12}, 0.5, 0.2)},
          {"roof.off", roof_mesh({14, 10}, {0.4, 0.3}, 2.0)},
          {"sheet.ply", sheet},
          {"sheet.stl", sheet},
          {"sheet.vtp", sheet},
          {"sheet.vtu", sheet},
          {"sheet.vtk", sheet},
          {"sheet.msh", sheet},
          {"curtain.msh", rectangle_mesh({32, 24}, {0.4, 0.3})}};
}

TEST(StoredMeshes, AreWhatTheGeneratorsGive) {
  for (const StoredMesh& stored : stored_meshes()) {
    const std::string path = std::string(PELLICLE_SOURCE_DIR) + "/meshes/" + stored.file;
    if (std::getenv("PELLICLE_WRITE_MESHES") != nullptr) {
      write_mesh(stored.mesh, path);
    }
    SurfaceMesh mesh = read_mesh(path);
    ASSERT_EQ(mesh.points.size(), stored.mesh.points.size()) << path;
    const MeshReport report = check_and_repair(mesh, path);
    EXPECT_EQ(report.remarks(), std::vector<std::string>{}) << path << " needed repair";
    if (report.triangles == 0) {  // stl: other numbers
      EXPECT_EQ(mesh.faces, stored.mesh.faces) << path;
      for (std::size_t i = 0; i < mesh.points.size(); ++i) {
        EXPECT_LE((mesh.points[i] - stored.mesh.points[i]).norm(), 1e-7) << path << " point " << i;
      }
    }
    if (path.substr(path.size() - 4) == ".msh") {
      EXPECT_EQ(mesh.groups, stored.mesh.groups);
    }
  }
}

}  // namespace
}  // namespace pellicle
