#include "meshing/triangulation.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "base/error.h"
#include "meshing/generators.h"
#include "meshing/mesh_check.h"
#include "tests/meshing/scratch_file.h"

namespace pellicle {
namespace {

using Faces = std::vector<std::vector<int>>;

TEST(Triangulated, SplitsQuadsAlongTheirShorterDiagonal) {
  SurfaceMesh mesh;
  mesh.points = {{0, 0, 0}, {2, 0, 0}, {3, 1, 0}, {1, 1, 0}, {5, 1, 0}, {4, 0, 0}};
  mesh.faces = {{0, 1, 2, 3}, {1, 5, 4, 2}, {3, 2, 0}};
  mesh.uv = {{{0, 0}, {1, 0}, {2, 0}, {3, 0}}, {{4, 0}, {5, 0}, {6, 0}, {7, 0}}, {{8, 0}, {9, 0}, {10, 0}}};
  mesh.face_fields["thickness"] = {1, 2, 3};
  mesh.groups["all"] = {0, 1, 2};
  mesh.face_groups = {{"ends", {0, 2}}, {"middle", {1}}};
  mesh.point_id = {3, 4, 5, 6, 7, 8};
  mesh.face_id = {1, 2, 4};
  const SurfaceMesh triangles = triangulated(mesh);
  EXPECT_EQ(triangles.faces, (Faces{{0, 1, 3}, {1, 2, 3}, {1, 5, 2}, {5, 4, 2}, {3, 2, 0}}));
  EXPECT_EQ(triangles.uv[0], (std::vector<Eigen::Vector2d>{{0, 0}, {1, 0}, {3, 0}}));
  EXPECT_EQ(triangles.uv[3], (std::vector<Eigen::Vector2d>{{5, 0}, {6, 0}, {7, 0}}));
  EXPECT_EQ(triangles.face_fields.at("thickness"), (std::vector<double>{1, 1, 2, 2, 3}));
  EXPECT_EQ(triangles.groups, mesh.groups);
  EXPECT_EQ(triangles.face_groups, (std::map<std::string, std::vector<int>>{{"ends", {0, 1, 4}}, {"middle", {2, 3}}}));
  EXPECT_EQ(triangles.point_id, mesh.point_id);
  EXPECT_EQ(triangles.id_of_face(4), 4);
}

TEST(Triangulated, LeavesTrianglesAsTheyAre) {
  SurfaceMesh mesh;
  mesh.points = {{0, 0, 0}, {2, 0, 0}, {3, 1, 0}};
  mesh.faces = {{2, 0, 1}};
  mesh.face_id = {7};
  EXPECT_EQ(triangulated(mesh).faces, mesh.faces);
  EXPECT_EQ(triangulated(mesh).face_id, mesh.face_id);
}

TEST(Triangulated, SplitsPolygonsThatAreNotConvex) {
  // An L of area 3 with normal +z: a fan from its first corner would leave it.
  SurfaceMesh mesh;
  mesh.points = {{2, 0, 0}, {2, 1, 0}, {1, 1, 0}, {1, 2, 0}, {0, 2, 0}, {0, 0, 0}};
  mesh.faces = {{0, 1, 2, 3, 4, 5}};
  const SurfaceMesh triangles = triangulated(mesh);
  ASSERT_EQ(triangles.faces.size(), 4U);
  double area = 0;
  for (const std::vector<int>& face : triangles.faces) {
    const auto at = [&](std::size_t k) { return mesh.points[face[k]]; };
    const double twice = (at(1) - at(0)).cross(at(2) - at(0)).z();
    EXPECT_GT(twice, 0);
    area += twice / 2;
  }
  EXPECT_NEAR(area, 3, 1e-14);
}

TEST(Triangulated, RefusesAPolygonThatCannotBeSplit) {
  SurfaceMesh mesh;
  mesh.points.assign(5, Eigen::Vector3d::Zero());
  mesh.faces = {{0, 1, 2, 3, 4}};
  mesh.face_id = {12};
  const std::string message = message_of<Error>([&mesh] { triangulated(mesh); });
  EXPECT_EQ(message.find("face 12: a polygon of 5 corners that cannot be split"), 0U) << message;
}

TEST(EnclosedVolume, IsThatOfABoxWhereverItLies) {
  SurfaceMesh mesh;
  for (int i = 0; i < 8; ++i) {
    mesh.points.emplace_back(100 + 2 * (i & 1), 50 + 3 * ((i >> 1) & 1), -70 + 0.5 * ((i >> 2) & 1));
  }
  mesh.faces = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  EXPECT_NEAR(enclosed_volume(mesh), 3, 1e-12);
}

}  // namespace
}  // namespace pellicle
