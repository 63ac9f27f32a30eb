#include "meshing/closed_shapes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "geometry/pi.h"
#include "meshing/mesh_check.h"
#include "tests/meshing/scratch_file.h"

namespace pellicle {
namespace {

/// Of a closed mesh of one piece, which needs no repair: not even to face outward.
MeshReport closed_report(SurfaceMesh mesh) {
  MeshReport report = check_and_repair(mesh, "generated");
  EXPECT_EQ(report.merged_points + report.removed_points + report.removed_faces + report.flipped_faces, 0);
  EXPECT_EQ(report.intersections.pairs, 0);
  EXPECT_EQ(report.components, 1);
  EXPECT_EQ(report.boundary_edges, 0);
  EXPECT_EQ(mesh.faces.front().size() == 3 ? report.triangles : report.quads, report.faces);
  EXPECT_EQ(report.euler_characteristic(), 2);
  EXPECT_GT(report.volume, 0);
  return report;
}

/// No face is drawn over more than `widest` of the texture's width, but those nearer to the axis than `pole`; none of
/// the others is mirrored.
void expect_uv_without_wrap(const SurfaceMesh& mesh, double widest, double pole) {
  ASSERT_EQ(mesh.uv.size(), mesh.faces.size());
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    const std::vector<Eigen::Vector2d>& corners = mesh.uv[f];
    ASSERT_EQ(corners.size(), mesh.faces[f].size());
    const bool near_axis = std::any_of(mesh.faces[f].begin(), mesh.faces[f].end(),
                                       [&](int point) { return mesh.points[point].head<2>().norm() < pole; });
    double left = 1;
    double right = 0;
    for (const Eigen::Vector2d& uv : corners) {
      EXPECT_GE(uv.minCoeff(), 0);
      EXPECT_LE(uv.maxCoeff(), 1);
      left = std::min(left, uv.x());
      right = std::max(right, uv.x());
    }
    if (near_axis) {
      continue;
    }
    EXPECT_LE(right - left, widest);
    const Eigen::Vector2d a = corners[1] - corners[0];
    const Eigen::Vector2d b = corners[2] - corners[0];
    EXPECT_GE(a.x() * b.y() - a.y() * b.x(), -1e-15);
  }
}

TEST(Icosphere, CountsOfEachLevel) {
  for (int level = 0; level <= 5; ++level) {
    const MeshReport report = closed_report(icosphere_mesh(level, 0.1));
    EXPECT_EQ(report.points, 10 * (1 << 2 * level) + 2);
    EXPECT_EQ(report.faces, 20 * (1 << 2 * level));
    EXPECT_EQ(report.valence.at(5), 12);
    EXPECT_GT(report.smallest_angle, 52 * pi / 180);
  }
  for (const Eigen::Vector3d& point : icosphere_mesh(3, 0.1).points) {
    EXPECT_NEAR(point.norm(), 0.1, 1e-16);
  }
}

TEST(Icosphere, AreaAndVolumeConvergeQuadratically) {
  const double area = 4 * pi * 0.01;
  const double volume = 4 * pi * 0.001 / 3;
  const MeshReport coarse = closed_report(icosphere_mesh(3, 0.1));
  const MeshReport fine = closed_report(icosphere_mesh(4, 0.1));
  EXPECT_LT(area - fine.area, 2e-3 * area);
  EXPECT_LT(volume - fine.volume, 4e-3 * volume);
  EXPECT_NEAR(std::log2((area - coarse.area) / (area - fine.area)), 2, 0.02);
  EXPECT_NEAR(std::log2((volume - coarse.volume) / (volume - fine.volume)), 2, 0.02);
}

TEST(Icosphere, TextureGoesRoundWithASeam) {
  const SurfaceMesh mesh = icosphere_mesh(3, 2);
  expect_uv_without_wrap(mesh, 0.201, 0);
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3d& point = mesh.points[mesh.faces[f][k]];
      const Eigen::Vector2d& uv = mesh.uv[f][k];
      EXPECT_NEAR(-std::cos(pi * uv.y()), point.z() / 2, 1e-12);
      if (std::abs(point.z()) < 1.999 && uv.x() > 0 && uv.x() < 1) {
        EXPECT_NEAR(std::remainder(std::atan2(point.y(), point.x()) - 2 * pi * (uv.x() - 0.5), 2 * pi), 0, 1e-12);
      }
    }
  }
}

TEST(Ellipsoid, HasItsVolumeAndHalfAxes) {
  const Eigen::Vector3d axes(0.1, 0.2, 0.3);
  const double volume = 4 * pi / 3 * axes.prod();
  const auto error = [&](int level) { return volume - closed_report(ellipsoid_mesh(level, axes)).volume; };
  EXPECT_LT(error(4), 4e-3 * volume);
  EXPECT_NEAR(std::log2(error(3) / error(4)), 2, 0.02);
  for (const Eigen::Vector3d& point : ellipsoid_mesh(2, axes).points) {
    EXPECT_NEAR(point.cwiseQuotient(axes).norm(), 1, 1e-15);
  }
}

TEST(QuadEllipsoid, IsClosedOfQuadsAndHasItsVolume) {
  const Eigen::Vector3d axes(0.1, 0.2, 0.3);
  const double volume = 4 * pi / 3 * axes.prod();
  const auto error = [&](int level) {
    const SurfaceMesh mesh = quad_ellipsoid_mesh(level, axes);
    for (const Eigen::Vector3d& point : mesh.points) {
      EXPECT_NEAR(point.cwiseQuotient(axes).norm(), 1, 1e-15);
    }
    const MeshReport report = closed_report(mesh);
    EXPECT_EQ(report.quads, 6 * (1 << 2 * level));
    return volume - report.volume;
  };
  EXPECT_NEAR(error(0), volume - std::pow(2 / std::sqrt(3.0), 3) * axes.prod(), 1e-15) << "a cube";
  EXPECT_NEAR(std::log2(error(3) / error(4)), 2, 0.02);
  expect_uv_without_wrap(quad_ellipsoid_mesh(4, axes), 0.25, 0.02);
}

TEST(Tube, HasItsVolumeAndWellShapedTriangles) {
  const double radius = 0.05;
  const double length = 0.2;
  const double volume = pi * radius * radius * length + 4 * pi / 3 * std::pow(radius, 3);
  const auto error = [&](int vertices) {
    const SurfaceMesh mesh = tube_mesh(length, radius, vertices);
    const MeshReport report = closed_report(mesh);
    EXPECT_EQ(report.points, vertices);
    EXPECT_GT(report.smallest_angle, 30 * pi / 180);
    EXPECT_LE(report.longest_edge, 2.5 * report.shortest_edge);
    expect_uv_without_wrap(mesh, 0.25, 0.6 * radius);
    for (const Eigen::Vector3d& point : mesh.points) {
      const double beyond = std::max(0.0, std::abs(point.z()) - 0.5 * length);
      EXPECT_NEAR(std::hypot(point.x(), point.y(), beyond), radius, 1e-9);
    }
    return volume - report.volume;
  };
  const double coarse = error(500);
  const double fine = error(2000);
  EXPECT_LT(fine, 1e-2 * volume);
  EXPECT_NEAR(coarse / fine, 4, 0.2);  // four times the points: half the edge length
}

TEST(ClosedShapes, RefuseWhatIsNoMesh) {
  EXPECT_THROW(icosphere_mesh(-1, 1), Error);
  EXPECT_THROW(icosphere_mesh(10, 1), Error);
  EXPECT_THROW(icosphere_mesh(1, 0), Error);
  EXPECT_THROW(ellipsoid_mesh(1, {1, 0, 1}), Error);
  EXPECT_THROW(quad_ellipsoid_mesh(-1, {1, 1, 1}), Error);
  EXPECT_THROW(quad_ellipsoid_mesh(1, {1, -1, 1}), Error);
  EXPECT_THROW(tube_mesh(0, 1, 500), Error);
  EXPECT_EQ(message_of<Error>([] { tube_mesh(1, 0.1, 5); }).find("mesh.vertices: 5 are too few for a tube"), 0U);
}

}  // namespace
}  // namespace pellicle
