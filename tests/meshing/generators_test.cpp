#include "meshing/generators.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>

#include "base/error.h"
#include "geometry/pi.h"
#include "meshing/closed_shapes.h"
#include "meshing/mesh_check.h"
#include "tests/meshing/scratch_file.h"

namespace pellicle {
namespace {

Eigen::Vector3d normal(const SurfaceMesh& mesh, std::size_t face) {
  const auto at = [&](std::size_t k) { return mesh.points[mesh.faces[face][k]]; };
  return (at(2) - at(0)).cross(at(3) - at(1));
}

/// A generated mesh needs no repair.
MeshReport report_of(SurfaceMesh mesh) {
  MeshReport report = check_and_repair(mesh, "generated");
  EXPECT_EQ(report.merged_points + report.removed_points + report.removed_faces + report.flipped_faces, 0);
  EXPECT_EQ(report.intersections.pairs, 0);
  EXPECT_EQ(report.components, 1);
  EXPECT_EQ(report.quads, report.faces);
  EXPECT_TRUE(mesh.point_id.empty());
  EXPECT_TRUE(mesh.face_id.empty());
  return report;
}

void expect_uv_of_unit_square(const SurfaceMesh& mesh) {
  ASSERT_EQ(mesh.uv.size(), mesh.faces.size());
  double area = 0;
  for (const auto& corners : mesh.uv) {
    ASSERT_EQ(corners.size(), 4U);
    for (const Eigen::Vector2d& uv : corners) {
      EXPECT_GE(uv.minCoeff(), 0);
      EXPECT_LE(uv.maxCoeff(), 1);
    }
    const Eigen::Vector2d a = corners[2] - corners[0];
    const Eigen::Vector2d b = corners[3] - corners[1];
    EXPECT_GT(a.x() * b.y() - a.y() * b.x(), 0);  // no corner wraps round the seam
    area += 0.5 * (a.x() * b.y() - a.y() * b.x());
  }
  EXPECT_LE(area, 1 + 1e-12);
}

TEST(Rectangle, CountsAreaAndNumbers) {
  const SurfaceMesh mesh = rectangle_mesh({5, 3}, {2.5, 0.75});
  const MeshReport report = report_of(mesh);
  EXPECT_EQ(report.points, 6 * 4);
  EXPECT_EQ(report.faces, 5 * 3);
  EXPECT_EQ(report.euler_characteristic(), 1);
  EXPECT_EQ(report.boundary_edges, 2 * (5 + 3));
  EXPECT_EQ(report.boundary_loops, 1);
  EXPECT_NEAR(report.area, 2.5 * 0.75, 1e-14);
  EXPECT_NEAR(report.smallest_angle, pi / 2, 1e-12);
  EXPECT_EQ(report.valence, (std::map<int, int>{{2, 4}, {3, 2 * (4 + 2)}, {4, 4 * 2}}));
  EXPECT_EQ(mesh.faces[0], (std::vector<int>{0, 1, 7, 6}));
  EXPECT_TRUE(mesh.points[0].isApprox(Eigen::Vector3d(-1.25, -0.375, 0)));
  EXPECT_TRUE(mesh.points[1].isApprox(Eigen::Vector3d(-0.75, -0.375, 0)));  // x first
  EXPECT_EQ(mesh.groups.at("left"), (std::vector<int>{0, 6, 12, 18}));
  EXPECT_EQ(mesh.groups.at("top").size(), 6U);
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    EXPECT_GT(normal(mesh, f).z(), 0);
  }
  expect_uv_of_unit_square(mesh);
  EXPECT_EQ(mesh.uv.back()[2], Eigen::Vector2d(1, 1));
}

TEST(Torus, CountsAndOutwardNormals) {
  const int n = 24;
  const int m = 12;
  const SurfaceMesh mesh = torus_mesh({n, m}, 0.5, 0.2);
  const MeshReport report = report_of(mesh);
  EXPECT_EQ(report.points, n * m);
  EXPECT_EQ(report.faces, n * m);
  EXPECT_EQ(report.euler_characteristic(), 0);
  EXPECT_EQ(report.boundary_edges, 0);
  EXPECT_EQ(report.boundary_loops, 0);
  EXPECT_EQ(report.valence, (std::map<int, int>{{4, n * m}}));
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (const int point : mesh.faces[f]) {
      centre += 0.25 * mesh.points[point];
    }
    const Eigen::Vector3d ring = 0.5 * Eigen::Vector3d(centre.x(), centre.y(), 0).normalized();
    EXPECT_GT(normal(mesh, f).dot(centre - ring), 0);
  }
  expect_uv_of_unit_square(mesh);
  EXPECT_EQ(mesh.uv[n - 1][1], Eigen::Vector2d(1, 0));  // the seam: point 0 is at u = 0 and 1
  EXPECT_EQ(mesh.faces[n - 1][1], 0);
}

TEST(Torus, AreaConvergesQuadratically) {
  const double exact = 4 * pi * pi * 0.5 * 0.2;
  const auto error = [exact](int n) { return exact - report_of(torus_mesh({2 * n, n}, 0.5, 0.2)).area; };
  EXPECT_LT(error(48) / exact, 5e-3);
  EXPECT_NEAR(std::log2(error(24) / error(48)), 2, 0.02);
}

TEST(Roof, CountsZigzagAndArc) {
  const int n = 38;
  const int m = 25;
  const double arch = 2;
  const SurfaceMesh mesh = roof_mesh({n, m}, {0.4, 0.3}, arch);
  const MeshReport report = report_of(mesh);
  EXPECT_EQ(report.faces, 2 * n * m - n - m - 3);
  EXPECT_EQ(report.euler_characteristic(), 1);
  EXPECT_EQ(report.boundary_loops, 1);
  // Two free edges for each tooth but the corners, and one of the quad behind each of those.
  EXPECT_EQ(report.boundary_edges, 2 * (2 * (n + m) - 8) + 4);
  EXPECT_EQ(report.valence.at(2), 2 * (n + m) - 8);
  EXPECT_EQ(report.valence.at(3), 8);
  EXPECT_EQ(report.valence.size(), 3U);
  const double radius = 0.3 / arch;
  double lowest = radius;
  for (const Eigen::Vector3d& point : mesh.points) {
    EXPECT_NEAR(std::hypot(point.y(), point.z()), radius, 1e-14);
    lowest = std::min(lowest, point.z());
  }
  EXPECT_NEAR(lowest, radius * std::cos(arch / 2), 1e-14);
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    EXPECT_GT(
        normal(mesh, f).dot(Eigen::Vector3d(0, mesh.points[mesh.faces[f][1]].y(), mesh.points[mesh.faces[f][1]].z())),
        0);
  }
  expect_uv_of_unit_square(mesh);
  EXPECT_EQ(mesh.groups.at("left").size(), static_cast<std::size_t>(m - 2));
  EXPECT_EQ(mesh.groups.at("bottom").size(), static_cast<std::size_t>(n - 2));
}

TEST(Roof, FlatLimitHasTheAreaOfItsQuads) {
  // A quad has half the area of its cell of the lattice.
  const MeshReport report = report_of(roof_mesh({8, 6}, {0.8, 0.6}, 1e-6));
  EXPECT_NEAR(report.area, report.faces * 0.5 * 0.1 * 0.1, 1e-12);
}

/// An open, flat mesh of triangles in the x-y plane that faces +z.
MeshReport report_of_flat(SurfaceMesh mesh) {
  MeshReport report = check_and_repair(mesh, "generated");
  EXPECT_EQ(report.remarks(), std::vector<std::string>{}) << "needed repair";
  EXPECT_EQ(report.triangles, report.faces);
  EXPECT_EQ(report.euler_characteristic(), 1);
  EXPECT_EQ(report.boundary_loops, 1);
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    const auto at = [&](std::size_t k) { return mesh.points[mesh.faces[f][k]]; };
    EXPECT_GT((at(1) - at(0)).cross(at(2) - at(0)).z(), 0);
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(at(k).z(), 0);
    }
  }
  return report;
}

TEST(Disc, CountsAngleAndRim) {
  const int n = 12;
  const SurfaceMesh mesh = disc_mesh(n, 0.2);
  const MeshReport report = report_of_flat(mesh);
  EXPECT_EQ(report.points, 1 + 3 * n * (n + 1));
  EXPECT_EQ(report.faces, 6 * n * n);
  EXPECT_EQ(report.boundary_edges, 6 * n);
  EXPECT_GT(report.smallest_angle, 40 * pi / 180);
  EXPECT_NEAR(report.area, 0.5 * 6 * n * 0.04 * std::sin(2 * pi / (6 * n)), 1e-14);  // of the polygon
  EXPECT_EQ(mesh.groups.at("centre"), std::vector<int>{0});
  EXPECT_TRUE(mesh.points[0].isZero(0));
  EXPECT_EQ(mesh.groups.at("rim").size(), static_cast<std::size_t>(6 * n));
  for (const int point : mesh.groups.at("rim")) {
    EXPECT_NEAR(mesh.points[point].norm(), 0.2, 1e-15);
  }
  EXPECT_TRUE(mesh.uv.back()[1].x() > 0.5 && mesh.uv.back()[1].y() < 0.5);  // the last sector ends at the x axis
}

TEST(Square, IsAQuarterCutByBothDiagonals) {
  const SurfaceMesh mesh = square_mesh({4, 3}, {0.4, 0.6});
  const MeshReport report = report_of_flat(mesh);
  EXPECT_EQ(report.points, 5 * 4 + 4 * 3);
  EXPECT_EQ(report.faces, 4 * 4 * 3);
  EXPECT_NEAR(report.area, 0.24, 1e-15);
  EXPECT_EQ(report.valence.at(3), 4);
  EXPECT_EQ(mesh.points[0], Eigen::Vector3d(0, 0, 0));
  EXPECT_TRUE(mesh.points[19].isApprox(Eigen::Vector3d(0.4, 0.6, 0)));
  EXPECT_EQ(mesh.groups.at("left"), (std::vector<int>{0, 5, 10, 15}));
  EXPECT_EQ(mesh.groups.at("bottom"), (std::vector<int>{0, 1, 2, 3, 4}));
  EXPECT_EQ(mesh.groups.at("right"), (std::vector<int>{4, 9, 14, 19}));
  EXPECT_EQ(mesh.groups.at("top"), (std::vector<int>{15, 16, 17, 18, 19}));
  EXPECT_NEAR(report_of_flat(square_mesh({5, 5}, {1, 1})).smallest_angle, pi / 4, 1e-12);
}

TEST(Generators, RefuseWhatHasNoRoomBeforeAnythingIsAllocated) {
  const int many = 2000000000;
  const auto expect_refused = [](const std::function<void()>& make, const std::string& part) {
    const std::string message = message_of<Error>(make);
    EXPECT_NE(message.find(part), std::string::npos) << "'" << part << "' is not in '" << message << "'";
    EXPECT_NE(message.find("faces, expected at most 1.34218e+08"), std::string::npos) << message;
  };
  expect_refused(
      [] {
        rectangle_mesh({1000000000, 1000000000}, {1, 1});
      },
      "a rectangle of 1000000000 x 1000000000 cells: 1e+18");
  expect_refused([&] { torus_mesh({many, many}, 1, 0.5); }, "a torus of 2000000000 x 2000000000 cells: 4e+18");
  expect_refused([&] { roof_mesh({many, 2}, {1, 1}, 1); }, "a roof of 2000000000 x 2 cells: 8e+09");
  expect_refused([&] { square_mesh({many, 1}, {1, 1}); }, "a square of 2000000000 x 1 cells: 8e+09");
  expect_refused([&] { disc_mesh(many, 1); }, "a disc of 2000000000 rings: 2.4e+19");
  expect_refused([&] { shirt_mesh({many, many}, {1, 1}); }, "a shirt of 2000000000 x 2000000000 cells: 8e+18");
  expect_refused([&] { tube_mesh(1, 0.1, many); }, "a tube of 2000000000 vertices: 4e+09");
  EXPECT_NE(message_of<Error>([] { tube_mesh(1e200, 1e200, 100); }).find("m across, expected 1e-60 to 1e+60 m"),
            std::string::npos);
}

TEST(Generators, RefuseWhatIsNoMesh) {
  EXPECT_THROW(rectangle_mesh({0, 3}, {1, 1}), Error);
  EXPECT_THROW(rectangle_mesh({1, 3}, {1, -1}), Error);
  EXPECT_THROW(torus_mesh({2, 3}, 1, 0.5), Error);
  EXPECT_THROW(torus_mesh({3, 3}, 1, 1), Error);
  EXPECT_THROW(roof_mesh({2, 1}, {1, 1}, 1), Error);
  EXPECT_THROW(roof_mesh({2, 2}, {1, 1}, 7), Error);
  EXPECT_THROW(disc_mesh(0, 1), Error);
  EXPECT_THROW(disc_mesh(1, 0), Error);
  EXPECT_THROW(square_mesh({0, 1}, {1, 1}), Error);
  EXPECT_THROW(square_mesh({1, 1}, {1, 0}), Error);
}

}  // namespace
}  // namespace pellicle
