#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <set>

#include "base/error.h"
#include "meshing/generators.h"
#include "meshing/mesh_check.h"

namespace pellicle {
namespace {

constexpr double degree = 3.14159265358979323846 / 180;

const Eigen::Vector3d& corner(const SurfaceMesh& mesh, std::size_t face, std::size_t k) {
  return mesh.points[mesh.faces[face][k % 4]];
}

/// A generated mesh needs no repair.
MeshReport shirt_report(SurfaceMesh mesh) {
  MeshReport report = check_and_repair(mesh, "shirt");
  EXPECT_EQ(report.remarks(), std::vector<std::string>{}) << "needed repair";
  EXPECT_EQ(report.intersections.pairs, 0);
  EXPECT_EQ(report.components, 1);
  EXPECT_EQ(fault_of_quads(mesh), "");
  return report;
}

TEST(Shirt, IsASphereWithFourHoles) {
  // Sleeves of 13 x 12 cells a side, shoulders of 10 cells, a neck 10 wide and cut 2 deep in front, 1 behind.
  const SurfaceMesh mesh = shirt_mesh({30, 40}, {0.6, 0.8});
  const MeshReport report = shirt_report(mesh);
  EXPECT_EQ(report.faces, 2 * 30 * 40 + 4 * 13 * 12 - 10 * (2 + 1));
  EXPECT_EQ(report.euler_characteristic(), 2 - 4);
  EXPECT_EQ(report.boundary_loops, 4);
  EXPECT_EQ(report.boundary_edges, 2 * 30 + 2 * 2 * 12 + 2 * 10 + 2 * (2 + 1));
  // Where the neckline turns down, four points of the boundary have an edge more.
  EXPECT_EQ(
      report.valence,
      (std::map<int, int>{{3, report.boundary_edges - 4}, {4, report.points - report.boundary_edges + 4 - 2}, {6, 2}}));
  EXPECT_EQ(mesh.groups.at("waist").size(), 2U * 30);
  EXPECT_EQ(mesh.groups.at("cuffs").size(), 2U * 2 * 12);
  EXPECT_EQ(mesh.groups.at("neck").size(), 2U * 10 + 2 * (2 + 1));
  EXPECT_EQ(mesh.groups.at("shoulders").size(), 2U * (10 + 1));
}

TEST(Shirt, HasTheSizeOfItsCut) {
  const double width = 0.5;
  const double height = 0.65;
  const SurfaceMesh mesh = shirt_mesh({40, 52}, {width, height});
  double girth = 0;
  Eigen::AlignedBox3d box;
  for (std::size_t face = 0; face < mesh.faces.size(); ++face) {
    for (std::size_t k = 0; k < 4; ++k) {
      const Eigen::Vector3d& here = corner(mesh, face, k);
      const Eigen::Vector3d& next = corner(mesh, face, k + 1);
      const bool at_waist = here.z() + next.z() < -height + 1e-12;
      girth += at_waist ? (next - here).norm() : 0;
      box.extend(here);
    }
  }
  EXPECT_NEAR(girth, 2 * width, 0.01 * 2 * width);
  EXPECT_NEAR(box.min().z(), -0.5 * height, 1e-12);
  EXPECT_NEAR(box.max().z(), 0.5 * height, 0.02 * height);
  EXPECT_NEAR(box.min().x(), -box.max().x(), 1e-9);  // as right, so left
  EXPECT_GT(box.max().x(), 0.8 * width);             // the sleeves are as long as half the torso is wide
  for (const int point : mesh.groups.at("shoulders")) {
    EXPECT_NEAR(mesh.points[point].y(), 0, 1e-12);
    EXPECT_GT(mesh.points[point].z(), 0.35 * height);
  }
}

TEST(Shirt, FacesOutward) {
  const SurfaceMesh mesh = shirt_mesh({20, 26}, {0.5, 0.65});
  for (std::size_t face = 0; face < mesh.faces.size(); ++face) {
    const Eigen::Vector3d centre =
        0.25 * (corner(mesh, face, 0) + corner(mesh, face, 1) + corner(mesh, face, 2) + corner(mesh, face, 3));
    const Eigen::Vector3d normal =
        (corner(mesh, face, 2) - corner(mesh, face, 0)).cross(corner(mesh, face, 3) - corner(mesh, face, 1));
    if (centre.z() < 0) {  // of the torso
      EXPECT_GT(normal.dot(Eigen::Vector3d(centre.x(), centre.y(), 0)), 0) << face;
    }
  }
}

TEST(Shirt, TextureIsTheCutLaidFlat) {
  const SurfaceMesh mesh = shirt_mesh({20, 26}, {0.5, 0.65});
  ASSERT_EQ(mesh.uv.size(), mesh.faces.size());
  std::set<std::pair<long, long>> cells;
  for (std::size_t face = 0; face < mesh.faces.size(); ++face) {
    const auto& uv = mesh.uv[face];
    ASSERT_EQ(uv.size(), 4U);
    // 20 + 2 * 8 cells across, twice; 26 upwards. All turn the same way, so that nothing is mirrored.
    const Eigen::Vector2d across = uv[2] - uv[0];
    const Eigen::Vector2d up = uv[3] - uv[1];
    EXPECT_NEAR(0.5 * (across.x() * up.y() - across.y() * up.x()), 1.0 / (2 * 36 * 26), 1e-15);
    const Eigen::Vector2d centre = 0.25 * (uv[0] + uv[1] + uv[2] + uv[3]);
    EXPECT_TRUE(cells.emplace(std::lround(centre.x() * 144), std::lround(centre.y() * 52)).second);
    if (corner(mesh, face, 0).z() < 0 && corner(mesh, face, 2).z() < 0) {
      EXPECT_EQ(centre.x() < 0.5, corner(mesh, face, 0).y() + corner(mesh, face, 2).y() < 0);
    }
  }
}

TEST(Shirt, CellsAreNearlySquare) {
  for (const int n : {10, 20, 40, 60}) {
    const SurfaceMesh mesh = shirt_mesh({n, 13 * n / 10}, {0.5, 0.65});
    const MeshReport report = shirt_report(mesh);
    double largest_angle = 0;
    double worst_face = 1;
    for (std::size_t face = 0; face < mesh.faces.size(); ++face) {
      double shortest = report.longest_edge;
      double longest = 0;
      for (std::size_t k = 0; k < 4; ++k) {
        const Eigen::Vector3d to_next = corner(mesh, face, k + 1) - corner(mesh, face, k);
        const Eigen::Vector3d to_last = corner(mesh, face, k + 3) - corner(mesh, face, k);
        largest_angle = std::max(largest_angle, std::acos(to_next.normalized().dot(to_last.normalized())));
        shortest = std::min(shortest, to_next.norm());
        longest = std::max(longest, to_next.norm());
      }
      worst_face = std::max(worst_face, longest / shortest);
    }
    const std::string name = "shirt_" + std::to_string(n);
    RecordProperty(name + "_edges", std::to_string(report.longest_edge / report.shortest_edge));
    RecordProperty(name + "_edges_of_a_face", std::to_string(worst_face));
    RecordProperty(name + "_angles",
                   std::to_string(report.smallest_angle / degree) + " " + std::to_string(largest_angle / degree));
    EXPECT_LT(report.longest_edge / report.shortest_edge, 3) << n;
    EXPECT_LT(worst_face, 2.2) << n;
    EXPECT_GT(report.smallest_angle, 45 * degree) << n;
    EXPECT_LT(largest_angle, 136 * degree) << n;
  }
}

TEST(Shirt, OtherProportionsAndTheCoarsest) {
  EXPECT_EQ(shirt_report(shirt_mesh({8, 8}, {1, 1})).boundary_loops, 4);
  EXPECT_EQ(shirt_report(shirt_mesh({40, 28}, {1, 0.7})).boundary_loops, 4);
  EXPECT_EQ(shirt_report(shirt_mesh({40, 80}, {1, 2})).boundary_loops, 4);
}

TEST(Shirt, RefusesWhatIsNoShirt) {
  EXPECT_THROW(shirt_mesh({7, 8}, {1, 1}), Error);
  EXPECT_THROW(shirt_mesh({8, 7}, {1, 1}), Error);
  EXPECT_THROW(shirt_mesh({8, 8}, {0, 1}), Error);
  EXPECT_THROW(shirt_mesh({8, 8}, {1, -1}), Error);
}

}  // namespace
}  // namespace pellicle
