#include <gtest/gtest.h>

#include "base/error.h"
#include "meshing/generators.h"
#include "meshing/mesh_options.h"
#include "meshing/triangulation.h"
#include "tests/meshing/mesh_writers.h"
#include "tests/meshing/scratch_file.h"

namespace pellicle {
namespace {

TEST(CheckedMesh, IsScaledToTheVolumeAboutTheOriginOfTheFile) {
  MeshOptions options;
  options.shape = "torus";
  options.cells = {20, 10};
  options.shift = {1, 2, 3};
  options.rotation = {0.3, 0, 0};
  const CheckedMesh before = make_checked_mesh(options);
  EXPECT_NEAR(before.report.volume, enclosed_volume(before.mesh), 1e-15);
  options.volume = 8 * before.report.volume;
  const CheckedMesh after = make_checked_mesh(options);
  EXPECT_NEAR(enclosed_volume(after.mesh), *options.volume, 1e-12);
  for (std::size_t i = 0; i < after.mesh.points.size(); ++i) {
    EXPECT_NEAR((after.mesh.points[i] - options.shift - 2 * (before.mesh.points[i] - options.shift)).norm(), 0, 1e-13);
  }
  EXPECT_NEAR(after.report.area, 4 * before.report.area, 1e-13);
  EXPECT_NEAR(after.report.longest_edge, 2 * before.report.longest_edge, 1e-14);
  EXPECT_NEAR(after.report.shortest_edge, 2 * before.report.shortest_edge, 1e-14);
  EXPECT_EQ(after.report.volume, *options.volume);
}

TEST(CheckedMesh, MayBeInsideOutInItsFile) {
  SurfaceMesh torus = torus_mesh({20, 10}, 0.5, 0.2);
  for (std::vector<int>& face : torus.faces) {
    std::reverse(face.begin(), face.end());
  }
  torus.uv.clear();
  const ScratchFile file("inside_out.obj");
  write_mesh(torus, file.path());
  MeshOptions options;
  options.file = file.path();
  options.volume = 0.25;
  const CheckedMesh checked = make_checked_mesh(options);
  EXPECT_NEAR(enclosed_volume(checked.mesh), 0.25, 1e-13);
  EXPECT_EQ(checked.report.flipped_faces, 200);
}

TEST(CheckedMesh, MustBeClosedToHaveAVolume) {
  MeshOptions options;
  options.cells = {4, 2};
  options.volume = 1;
  EXPECT_EQ(
      message_of<Error>([&options] { make_checked_mesh(options); }),
      "mesh.volume: rectangle: 15 points, 8 faces (8 quads, 0 triangles), 1 piece, open, 12 boundary edges in 1 loop; "
      "expected a closed mesh");
}

}  // namespace
}  // namespace pellicle
