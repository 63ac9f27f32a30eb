#include "meshing/mesh_check.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "meshing/closed_shapes.h"
#include "meshing/generators.h"
#include "meshing/overlaps.h"
#include "tests/meshing/scratch_file.h"
#include "tests/support/balls.h"

namespace pellicle {
namespace {

using testing::PrintToString;

std::string fault_of(SurfaceMesh mesh) {
  return message_of<Error>([&mesh] { check_and_repair(mesh, "it.obj"); });
}

void expect_in(const std::string& message, const std::string& part) {
  EXPECT_NE(message.find(part), std::string::npos) << "'" << part << "' is not in '" << message << "'";
  EXPECT_EQ(message.find('\n'), std::string::npos) << message;
}

SurfaceMesh grid() { return rectangle_mesh({4, 3}, {4, 3}); }  // 5 x 4 points, 12 faces of side 1

TEST(MeshCheck, MergesDuplicatePoints) {
  // The last column of cells gets points of its own on the seam.
  SurfaceMesh mesh = grid();
  const SurfaceMesh whole = mesh;
  for (int row = 0; row < 4; ++row) {
    mesh.points.push_back(mesh.points[3 + 5 * static_cast<std::size_t>(row)]);
    const int copy = static_cast<int>(mesh.points.size()) - 1;
    for (const int f : {4 * row + 3, 4 * row - 1}) {
      if (f >= 0 && f < 12) {
        std::replace(mesh.faces[f].begin(), mesh.faces[f].end(), 3 + 5 * row, copy);
      }
    }
  }
  mesh.groups["seam"] = {20, 21, 22, 23, 3};
  const MeshReport report = check_and_repair(mesh, "it");
  EXPECT_EQ(report.merged_points, 4);
  EXPECT_EQ(report.components, 1);
  EXPECT_EQ(mesh.faces, whole.faces);
  EXPECT_EQ(mesh.points, whole.points);
  EXPECT_EQ(mesh.groups.at("seam"), (std::vector<int>{3, 8, 13, 18}));
  EXPECT_EQ(mesh.groups.at("left"), whole.groups.at("left"));
  expect_in(PrintToString(report.remarks()), "4 duplicate points merged");
}

TEST(MeshCheck, RemovesUnusedPointsAndKeepsTheirNumbers) {
  SurfaceMesh mesh = grid();
  mesh.points.insert(mesh.points.begin() + 2, Eigen::Vector3d(9, 9, 9));
  for (std::vector<int>& face : mesh.faces) {
    for (int& point : face) {
      point += point >= 2 ? 1 : 0;
    }
  }
  mesh.groups = {{"odd", {2, 3}}};
  const MeshReport report = check_and_repair(mesh, "it");
  EXPECT_EQ(report.removed_points, 1);
  EXPECT_EQ(mesh.points, grid().points);
  EXPECT_EQ(mesh.faces, grid().faces);
  EXPECT_EQ(mesh.id_of_point(1), 1);
  EXPECT_EQ(mesh.id_of_point(2), 3);
  EXPECT_EQ(mesh.id_of_face(2), 2);
  EXPECT_EQ(mesh.groups.at("odd"), (std::vector<int>{2}));
}

TEST(MeshCheck, RemovesRepeatedAndCollapsedFaces) {
  SurfaceMesh mesh = grid();
  // Face 3 again, turned and from another corner; a triangle that names one point twice; faces after them count on.
  mesh.faces.insert(mesh.faces.begin() + 5, {mesh.faces[3][2], mesh.faces[3][1], mesh.faces[3][0], mesh.faces[3][3]});
  mesh.uv.insert(mesh.uv.begin() + 5, mesh.uv[3]);
  mesh.faces.insert(mesh.faces.begin(), {0, 0, 1});
  mesh.uv.insert(mesh.uv.begin(), {{0, 0}, {0, 0}, {0, 1}});
  const MeshReport report = check_and_repair(mesh, "it");
  EXPECT_EQ(report.removed_faces, 2);
  EXPECT_EQ(mesh.faces, grid().faces);
  EXPECT_EQ(mesh.uv, grid().uv);
  EXPECT_EQ(mesh.id_of_face(0), 1);
  EXPECT_EQ(mesh.id_of_face(5), 7);
}

TEST(MeshCheck, FlipsTheMinority) {
  SurfaceMesh mesh = grid();
  for (const std::size_t f : {0U, 1U, 2U, 7U, 11U}) {
    std::reverse(mesh.faces[f].begin() + 1, mesh.faces[f].end());
    std::reverse(mesh.uv[f].begin() + 1, mesh.uv[f].end());
  }
  const MeshReport report = check_and_repair(mesh, "it");
  EXPECT_EQ(report.flipped_faces, 5);
  EXPECT_EQ(mesh.faces, grid().faces);
  EXPECT_EQ(mesh.uv, grid().uv);
  EXPECT_EQ(check_and_repair(mesh, "it").flipped_faces, 0);
}

TEST(MeshCheck, TurnsClosedPiecesOutward) {
  // Of two tori one is inside out, the other has a few faces against the rest.
  SurfaceMesh mesh = torus_mesh({8, 6}, 3, 1);
  mesh.uv.clear();
  const SurfaceMesh outward = mesh;
  for (std::vector<int>& face : mesh.faces) {
    std::reverse(face.begin() + 1, face.end());
  }
  EXPECT_EQ(check_and_repair(mesh, "it").flipped_faces, 48);
  EXPECT_EQ(mesh.faces, outward.faces);
  for (std::size_t f = 4; f < 48; ++f) {  // most of them
    std::reverse(mesh.faces[f].begin() + 1, mesh.faces[f].end());
  }
  const MeshReport report = check_and_repair(mesh, "it");
  EXPECT_EQ(report.flipped_faces, 44);
  EXPECT_EQ(mesh.faces, outward.faces);
  EXPECT_GT(report.volume, 0);
  expect_in(PrintToString(report.remarks()), "44 faces flipped to agree with the neighbours or to face outward");
}

TEST(MeshCheck, KeepsLayersThatLieOnEachOtherApart) {
  SurfaceMesh mesh = grid();
  mesh.uv.clear();
  for (const Eigen::Vector3d& point : grid().points) {
    mesh.points.push_back(point);
  }
  for (std::vector<int> face : grid().faces) {
    for (int& point : face) {
      point += 20;
    }
    mesh.faces.push_back(face);
  }
  SurfaceMesh merged = mesh;
  const MeshReport report = check_and_repair(mesh, "it", std::nullopt);
  EXPECT_EQ(report.merged_points, 0);
  EXPECT_EQ(report.components, 2);
  EXPECT_EQ(mesh.points.size(), 40U);
  EXPECT_EQ(report.intersections.pairs, 0);
  EXPECT_EQ(check_and_repair(merged, "it").removed_faces, 12);
  EXPECT_EQ(merged.points.size(), 20U);
}

TEST(MeshCheck, FieldsFollowTheirFaces) {
  SurfaceMesh mesh = grid();
  mesh.faces.insert(mesh.faces.begin() + 5, mesh.faces[3]);
  mesh.uv.insert(mesh.uv.begin() + 5, mesh.uv[3]);
  for (int f = 0; f < 13; ++f) {
    mesh.face_fields["thickness"].push_back(f);
  }
  mesh.face_groups = {{"first", {0, 3}}, {"again", {5, 6}}, {"last", {12}}};
  check_and_repair(mesh, "it");
  EXPECT_EQ(mesh.face_groups,
            (std::map<std::string, std::vector<int>>{{"first", {0, 3}}, {"again", {3, 5}}, {"last", {11}}}));
  EXPECT_EQ(mesh.face_fields.at("thickness"), (std::vector<double>{0, 1, 2, 3, 4, 6, 7, 8, 9, 10, 11, 12}));
}

TEST(MeshCheck, RefusesAMoebiusBand) {
  SurfaceMesh mesh;
  const int n = 12;
  for (int i = 0; i < n; ++i) {
    const double angle = 2 * 3.14159265358979323846 * i / n;
    const Eigen::Vector3d outward(std::cos(angle), std::sin(angle), 0);
    const Eigen::Vector3d across =
        0.3 * (std::cos(angle / 2) * outward + std::sin(angle / 2) * Eigen::Vector3d::UnitZ());
    mesh.points.emplace_back(outward - across);
    mesh.points.emplace_back(outward + across);
  }
  for (int i = 0; i < n; ++i) {
    const int a = 2 * i;
    const int b = i + 1 < n ? a + 2 : 1;  // half a turn: the far end meets the near one crosswise
    mesh.faces.push_back({a, b, i + 1 < n ? b + 1 : 0, a + 1});
  }
  expect_in(fault_of(mesh), "it.obj: 1 one-sided piece that cannot be oriented");
}

TEST(MeshCheck, RefusesAnEdgeOfThreeFaces) {
  SurfaceMesh mesh = grid();
  mesh.points.emplace_back(-1, 0, 1);
  mesh.points.emplace_back(0, 0, 1);
  mesh.faces.push_back({6, 7, 21, 20});
  mesh.uv.push_back({{0, 0}, {0, 0}, {0, 0}, {0, 0}});
  expect_in(fault_of(mesh), "it.obj: 1 non-manifold edge (6-7)");
}

TEST(MeshCheck, RefusesTwoFansAtAPoint) {
  // Two squares that meet at a corner.
  SurfaceMesh mesh;
  mesh.points = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {2, 1, 0}, {2, 2, 0}, {1, 2, 0}};
  mesh.faces = {{0, 1, 2, 3}, {2, 4, 5, 6}};
  expect_in(fault_of(mesh), "it.obj: 1 non-manifold vertex (2)");
}

TEST(MeshCheck, RefusesFacesWithoutArea) {
  SurfaceMesh line = grid();
  line.points.emplace_back(-1, -1.5, 0);  // between points 1 and 2 on the boundary, no face ends there
  line.points.back() = 0.5 * (line.points[0] + line.points[1]);
  line.faces.push_back({0, 20, 1});
  line.uv.push_back({{0, 0}, {0, 0}, {0, 0}});
  expect_in(fault_of(line), "1 degenerate face (12)");
  SurfaceMesh repeated = grid();
  repeated.faces[4] = {5, 6, 5, 10};
  expect_in(fault_of(repeated), "1 degenerate face (4)");
}

TEST(MeshCheck, RefusesInvertedQuads) {
  SurfaceMesh crossed = grid();
  std::swap(crossed.faces[5][2], crossed.faces[5][3]);
  expect_in(fault_of(crossed), "1 inverted or folded quad (5)");
  SurfaceMesh pulled = grid();
  pulled.points[6] += Eigen::Vector3d(0.7, 0.7, 0);  // over the diagonal of face 5
  expect_in(fault_of(pulled), "1 inverted or folded quad (5)");
  SurfaceMesh sheared = grid();
  sheared.points[6] += Eigen::Vector3d(0.4, 0.4, 0);
  EXPECT_EQ(fault_of(sheared), "");
}

TEST(MeshCheck, CountsFaultsAndNamesTheFirst) {
  SurfaceMesh mesh = grid();
  for (std::size_t f = 0; f < 12; f += 2) {
    std::swap(mesh.faces[f][2], mesh.faces[f][3]);
  }
  expect_in(fault_of(mesh), "6 inverted or folded quads (0, 2, 4, 6, 8, ...)");
}

TEST(MeshCheck, CountsPiecesAndLoops) {
  SurfaceMesh mesh = rectangle_mesh({5, 5}, {1, 1});
  mesh.faces.erase(mesh.faces.begin() + 12);  // a hole in the middle
  mesh.uv.erase(mesh.uv.begin() + 12);
  mesh = joined(mesh, torus_mesh({8, 6}, 3, 1), Eigen::Vector3d::Zero());
  const MeshReport report = check_and_repair(mesh, "it");
  EXPECT_EQ(report.components, 2);
  EXPECT_EQ(report.boundary_loops, 2);
  EXPECT_EQ(report.boundary_edges, 20 + 4);
  EXPECT_EQ(report.euler_characteristic(), 0);
}

TEST(MeshCheck, CountsSelfIntersections) {
  // A triangle that stands in the middle of a quad pierces both triangles of it, or one.
  SurfaceMesh mesh;
  mesh.points = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 0.2, -1}, {0.5, 0.8, -1}, {0.5, 0.5, 1}};
  mesh.faces = {{0, 1, 2, 3}, {4, 5, 6}};
  EXPECT_EQ(check_and_repair(mesh, "it").intersections.pairs, 2);
  for (std::size_t i = 4; i < 7; ++i) {
    mesh.points[i].x() = 0.9;
    mesh.points[i].y() = 0.3 + 0.2 * (mesh.points[i].y() - 0.5);
  }
  EXPECT_EQ(check_and_repair(mesh, "it").intersections.pairs, 1);
  for (std::size_t i = 4; i < 7; ++i) {
    mesh.points[i].x() = 1.1;
  }
  EXPECT_EQ(check_and_repair(mesh, "it").intersections.pairs, 0);
}

TEST(MeshCheck, CountsSelfIntersectionsOfWhatOverlapsEverywhereOnlySoFar) {
  // Needles along one diagonal, apart from each other: all of their boxes overlap.
  std::vector<Eigen::Vector3d> points;
  std::vector<std::array<int, 3>> triangles;
  for (int k = 0; k < 4000; ++k) {
    const Eigen::Vector3d aside(1e-5 * k, -1e-5 * k, 0);
    points.insert(points.end(), {aside, aside + Eigen::Vector3d(1, 1, 1), aside + Eigen::Vector3d(1, 1, 1 + 1e-3)});
    triangles.push_back({3 * k, 3 * k + 1, 3 * k + 2});
  }
  const SelfIntersections result = count_self_intersections(points, triangles);
  EXPECT_EQ(result.pairs, 0);
  EXPECT_FALSE(result.all);
  triangles.resize(1000);
  EXPECT_TRUE(count_self_intersections(points, triangles).all);
}

TEST(MeshCheck, RefusesAPolygonThatCrossesItself) {
  SurfaceMesh mesh;
  for (const int corner : {0, 2, 4, 1, 3}) {  // a star, drawn in one stroke
    mesh.points.emplace_back(std::cos(0.4 * M_PI * corner), std::sin(0.4 * M_PI * corner), 0);
  }
  mesh.faces = {{0, 1, 2, 3, 4}};
  const std::string message = message_of<Error>([&mesh] { check_and_repair(mesh, "star"); });
  EXPECT_EQ(
      message,
      "star: 1 polygon that cannot be split into triangles (0) (numbers from 0), expected a manifold surface; it has "
      "5 points, 1 faces (0 quads, 0 triangles), 1 piece, open, 5 boundary edges in 1 loop");
}

TEST(MeshCheck, RefusesAPointOfVeryManyTriangles) {
  const int count = 10001;
  SurfaceMesh mesh;
  mesh.points.emplace_back(0, 0, 1);
  for (int k = 0; k < count; ++k) {
    mesh.points.emplace_back(std::cos(2 * M_PI * k / count), std::sin(2 * M_PI * k / count), 0);
    mesh.faces.push_back({0, 1 + k, 1 + (k + 1) % count});
  }
  EXPECT_EQ(message_of<Error>([&mesh] { check_and_repair(mesh, "cone"); }),
            "cone: 10001 triangles meet at point 0, expected at most 10000");
}

TEST(MeshCheck, ACollapsedFaceOfManyCornersTakesNoTime) {
  SurfaceMesh mesh = rectangle_mesh({1, 1}, {1, 1});
  mesh.uv.clear();
  mesh.faces.emplace_back(1000000, 1);
  mesh.faces.push_back({0, 0, 1, 1, 1, 3, 3, 2, 0});  // the same square again, corners repeated
  EXPECT_EQ(check_and_repair(mesh, "square").removed_faces, 2);
  EXPECT_EQ(mesh.faces.size(), 1U);
}

TEST(MeshCheck, MeasuresQuality) {
  SurfaceMesh mesh;
  mesh.points = {{0, 0, 0}, {3, 0, 0}, {3, 4, 0}};
  mesh.faces = {{0, 1, 2}};
  const MeshReport report = check_and_repair(mesh, "it");
  EXPECT_DOUBLE_EQ(report.area, 6);
  EXPECT_NEAR(report.smallest_angle, std::atan2(3, 4), 1e-14);
  EXPECT_DOUBLE_EQ(report.shortest_edge, 3);
  EXPECT_DOUBLE_EQ(report.longest_edge, 5);
  EXPECT_NEAR(report.smallest_radius_ratio, 2 * 1 / 2.5, 1e-14);
  mesh.points.emplace_back(1.5, -1.5 * std::sqrt(3), 0);  // below the first side: an equilateral triangle
  mesh.faces.push_back({1, 0, 3});
  const MeshReport two = check_and_repair(mesh, "it");
  EXPECT_NEAR(two.smallest_radius_ratio, 0.8, 1e-14);
  EXPECT_NEAR(two.mean_radius_ratio, 0.9, 1e-14);
}

TEST(MeshCheck, SaysWhatIsTooFarFromTheOriginForItsSize) {
  const auto at = [](double place) {
    SurfaceMesh mesh = rectangle_mesh({10, 10}, {1, 1});  // sides of 0.1 m
    for (Eigen::Vector3d& point : mesh.points) {
      point.z() -= place;
    }
    return mesh;
  };
  SurfaceMesh near = at(1e5);
  EXPECT_EQ(check_and_repair(near, "it").remarks(), std::vector<std::string>{});
  SurfaceMesh far = at(1e7);
  expect_in(PrintToString(check_and_repair(far, "it").remarks()),
            "warning: so far from the origin that places are rounded to 2.2e-08 of a side; mesh.shift moves it");
  SurfaceMesh farther = at(1e14);
  EXPECT_EQ(message_of<Error>([&farther] { check_and_repair(farther, "it"); }),
            "it: 1e+14 m from the origin, where places are rounded to 0.0222045 m; expected at most 1e-06 of the mean "
            "side, 0.1 m: a mesh nearer to the origin");
}

/// The grid, of which the last column of cells has points of its own on the seam, moved by a gap.
SurfaceMesh torn_grid(double gap) {
  SurfaceMesh mesh = grid();
  for (int row = 0; row < 4; ++row) {
    mesh.points.push_back(mesh.points[3 + 5 * static_cast<std::size_t>(row)] + Eigen::Vector3d(0, gap, 0));
    for (const int f : {4 * row + 3, 4 * row - 1}) {
      if (f >= 0 && f < 12) {
        std::vector<int>& face = mesh.faces[f];
        std::replace(face.begin(), face.end(), 3 + 5 * row, 20 + row);
      }
    }
  }
  return mesh;
}

TEST(MeshCheck, CountsPointsThatNearlyMeetAndMergesThemWithinADistance) {
  SurfaceMesh torn = torn_grid(-2e-7);
  const MeshReport report = check_and_repair(torn, "it");
  EXPECT_EQ(report.components, 2);
  EXPECT_EQ(report.slits.near_points, 8);
  expect_in(PrintToString(report.remarks()),
            "warning: 8 points lie as good as on others and are not joined to them, at most 2e-07 m apart: "
            "mesh.merge_distance 3e-07 merges them");
  SurfaceMesh merged = torn_grid(-2e-7);
  const MeshReport repaired = check_and_repair(merged, "it", 3e-7);
  EXPECT_EQ(repaired.merged_points, 4);
  EXPECT_EQ(repaired.components, 1);
  EXPECT_EQ(repaired.remarks(),
            std::vector<std::string>{"repaired: 4 duplicate points merged with others at the same place"});
  EXPECT_EQ(merged.points, grid().points);
  EXPECT_EQ(merged.faces, grid().faces);
  SurfaceMesh apart = torn_grid(-2e-5);
  EXPECT_EQ(check_and_repair(apart, "it").slits.near_points, 0);
  // The digits of a text of single precision.
  SurfaceMesh far = torn_grid(-2e-5);
  for (Eigen::Vector3d& point : far.points) {
    point.x() += 30;
  }
  EXPECT_EQ(check_and_repair(far, "it").slits.near_points, 8);
  SurfaceMesh chain = torn_grid(-2e-7);  // of points, the ends of which are further apart
  EXPECT_EQ(check_and_repair(chain, "it", 1e-7).merged_points, 0);
  SurfaceMesh everything = grid();
  expect_in(message_of<Error>([&everything] { check_and_repair(everything, "it", 1); }), "no face is left");
}

TEST(MeshCheck, NamesPointsOnSidesOfOtherFaces) {
  SurfaceMesh mesh = grid();
  mesh.uv.clear();
  // Face 5, in the middle, in two halves, of which the faces below and above know nothing.
  mesh.points.emplace_back(0.5 * (mesh.points[6] + mesh.points[7]));
  mesh.points.emplace_back(0.5 * (mesh.points[11] + mesh.points[12]));
  mesh.faces[5] = {6, 20, 21, 11};
  mesh.faces.push_back({20, 7, 12, 21});
  const MeshReport report = check_and_repair(mesh, "it");
  EXPECT_EQ(report.slits.on_sides, (std::vector<int>{20, 21}));
  EXPECT_EQ(report.slits.near_points, 0);
  expect_in(PrintToString(report.remarks()),
            "warning: points 20, 21 lie on sides of faces that do not have them: slits");
  SurfaceMesh aside = mesh;
  aside.points[20].y() += 1e-3;
  const MeshReport one = check_and_repair(aside, "it");
  EXPECT_EQ(one.slits.on_sides, std::vector<int>{21});
  expect_in(PrintToString(one.remarks()), "warning: point 21 lies on a side of a face that does not have it: slits");
}

TEST(MeshCheck, FindsClosedPiecesInsideOthers) {
  const SurfaceMesh ball = icosphere_mesh(1, 1);
  const auto smaller = [&ball](double radius) {
    SurfaceMesh mesh = ball;
    for (Eigen::Vector3d& point : mesh.points) {
      point *= radius;
    }
    return mesh;
  };
  SurfaceMesh nested = joined(joined(smaller(0.2), ball, {0, 0, 0}), smaller(0.3), {0.5, 0, 0});
  const MeshReport report = check_and_repair(nested, "it");
  EXPECT_EQ(report.nested.count, 2);
  EXPECT_EQ(report.nested.first, (std::array<int, 2>{0, 42}));
  SurfaceMesh beside = joined(ball, smaller(0.1), {0.9, 0.9, 0});  // in the box of the other, not in it
  EXPECT_EQ(check_and_repair(beside, "it").nested.count, 0);
  SurfaceMesh in_a_cup = joined(joined(disc_mesh(3, 4), ball, {0, 0, 2}), ball, {9, 0, 0});
  EXPECT_EQ(check_and_repair(in_a_cup, "it").nested.count, 0);
}

TEST(FaultOfQuads, NamesTheFirstOtherFace) {
  SurfaceMesh mesh = grid();
  EXPECT_EQ(fault_of_quads(mesh), "");
  mesh.faces[7].pop_back();
  expect_in(fault_of_quads(mesh), "1 of 12 faces are no quads (the first is face 7 with 3 corners), expected quads");
}

}  // namespace
}  // namespace pellicle
