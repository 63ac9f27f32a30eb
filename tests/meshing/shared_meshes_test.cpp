// Real meshes from elsewhere: shared/meshes/README.md says how each must behave. Skipped where they are absent.

#include <gtest/gtest.h>

#include "base/error.h"
#include "meshing/mesh_check.h"
#include "meshing/readers.h"
#include "tests/meshing/scratch_file.h"
#include "tests/support/shared_folder.h"

namespace pellicle {
namespace {

class SharedMeshes : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::is_directory(shared_folder() / "meshes")) {
      GTEST_SKIP() << (shared_folder() / "meshes") << " is absent (set PELLICLE_SHARED)";
    }
  }
  static std::string path_of(const std::string& name) { return (shared_folder() / "meshes" / name).string(); }
  MeshReport accept(const std::string& name) {
    mesh_ = read_mesh(path_of(name));
    MeshReport report = check_and_repair(mesh_, path_of(name));
    EXPECT_EQ(report.merged_points + report.removed_points + report.removed_faces + report.flipped_faces, 0);
    EXPECT_EQ(report.components, 1);
    return report;
  }
  static std::string refuse(const std::string& name) {
    SurfaceMesh mesh = read_mesh(path_of(name));
    return message_of<Error>([&] { check_and_repair(mesh, path_of(name)); });
  }
  static void expect_in(const std::string& message, const std::string& part) {
    EXPECT_NE(message.find(part), std::string::npos) << "'" << part << "' is not in '" << message << "'";
  }

  static constexpr double degree = 3.14159265358979323846 / 180;
  SurfaceMesh mesh_;
};

TEST_F(SharedMeshes, Teddy) {
  const MeshReport report = accept("teddy.off");
  EXPECT_EQ(report.points, 12543);
  EXPECT_EQ(report.triangles, 25082);
  EXPECT_EQ(report.boundary_edges, 0);
  EXPECT_EQ(report.euler_characteristic(), 2);
  EXPECT_EQ(report.intersections.pairs, 0);
  EXPECT_NEAR(report.smallest_angle, 19 * degree, 0.5 * degree);
}

TEST_F(SharedMeshes, Cheburashka) {
  const MeshReport report = accept("cheburashka.obj");
  EXPECT_EQ(report.points, 6669);
  EXPECT_EQ(report.triangles, 13334);
  EXPECT_EQ(report.euler_characteristic(), 2);
  EXPECT_EQ(report.boundary_edges, 0);
  EXPECT_EQ(report.valence.rbegin()->first, 11);
  EXPECT_NEAR(report.smallest_angle, 1 * degree, 0.5 * degree);
}

TEST_F(SharedMeshes, SpotInTriangles) {
  const MeshReport report = accept("spot_triangles.obj");
  EXPECT_EQ(report.points, 2930);
  EXPECT_EQ(report.triangles, 5856);
  EXPECT_EQ(report.valence.rbegin()->first, 8);
  EXPECT_EQ(mesh_.uv.size(), 5856U);
  expect_in(fault_of_quads(mesh_), "5856 of 5856 faces are no quads");
}

TEST_F(SharedMeshes, SpotInQuads) {
  const MeshReport report = accept("spot_quads.obj");
  EXPECT_EQ(report.points, 2930);
  EXPECT_EQ(report.quads, 2928);
  EXPECT_EQ(report.faces, 2928);
  EXPECT_EQ(report.valence, (std::map<int, int>{{3, 56}, {4, 2830}, {5, 40}, {6, 4}}));
  EXPECT_EQ(report.euler_characteristic(), 2);
  EXPECT_NEAR(report.longest_edge / report.shortest_edge, 26, 0.5);
  EXPECT_EQ(mesh_.uv.size(), 2928U);
  EXPECT_EQ(fault_of_quads(mesh_), "");
}

TEST_F(SharedMeshes, Roof) {
  const MeshReport report = accept("roof_quads.off");
  EXPECT_EQ(report.points, 1963);
  EXPECT_EQ(report.quads, 1838);
  EXPECT_EQ(report.boundary_edges, 248);
  EXPECT_EQ(report.boundary_loops, 1);
  EXPECT_EQ(report.valence.rbegin()->first, 4);
  EXPECT_NEAR(report.longest_edge / report.shortest_edge, 1.3, 0.05);
  EXPECT_EQ(fault_of_quads(mesh_), "");
}

TEST_F(SharedMeshes, CowIsRefused) {
  const std::string message = refuse("cow_faulty.obj");
  expect_in(message, "cow_faulty.obj: 1 non-manifold vertex (253)");
  expect_in(message, "71 pairs of triangles cut through each other");
}

TEST_F(SharedMeshes, TeapotIsRefused) {
  const std::string message = refuse("teapot_faulty.obj");
  expect_in(message, "teapot_faulty.obj: 1 non-manifold vertex (373)");
  expect_in(message, "repaired: 403 duplicate points merged");
}

}  // namespace
}  // namespace pellicle
