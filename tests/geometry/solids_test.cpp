#include "geometry/solids.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "geometry/deepest_point.h"
#include "geometry/solid_distance.h"

namespace pellicle {
namespace {

using Point = Eigen::Vector3d;
using Corners = std::array<Point, 3>;

class RandomPoints {
 public:
  Point next(double size) { return {size * fraction_(engine_), size * fraction_(engine_), size * fraction_(engine_)}; }

 private:
  std::mt19937 engine_{7};
  std::uniform_real_distribution<double> fraction_{-1, 1};
};

/// A box as a mesh of twelve triangles.
std::shared_ptr<const ClosedMesh> box_mesh(const Point& half) {
  std::vector<Point> points;
  for (int i = 0; i < 8; ++i) {
    points.emplace_back((i & 1 ? 1 : -1) * half[0], (i & 2 ? 1 : -1) * half[1], (i & 4 ? 1 : -1) * half[2]);
  }
  const Triangles triangles{{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                            {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  EXPECT_EQ(fault_of_closed_mesh(points, triangles), "");
  return std::make_shared<const ClosedMesh>(points, triangles);
}

std::vector<Shape> all_shapes() {
  return {Sphere{0.5},         HalfSpace{},     Box{{0.5, 0.3, 0.2}},     Capsule{0.2, 0.4},
          Cylinder{0.4, 0.25}, Ring{0.5, 0.15}, box_mesh({0.5, 0.3, 0.2})};
}

TEST(Solids, HaveTheDistancesOfFormulas) {
  RandomPoints points;
  const Shape mesh = box_mesh({0.5, 0.3, 0.2});
  for (int n = 0; n < 2000; ++n) {
    const Point p = points.next(0.8);
    const auto distance = [&p](const auto& shape) { return shape.distance(p).distance; };
    EXPECT_NEAR(distance(Sphere{0.5}), p.norm() - 0.5, 1e-15);
    EXPECT_EQ(distance(HalfSpace{}), p.z());
    const double of_box = distance_from_box(p, {0.5, 0.3, 0.2}, 0);
    EXPECT_NEAR(distance(Box{{0.5, 0.3, 0.2}}), of_box, 1e-15);
    EXPECT_NEAR(signed_distance(Solid{mesh, {}}, p).distance, of_box, 1e-14);
    EXPECT_NEAR(distance(Capsule{0.2, 0.4}), distance_from_round_cone(p + Point(0, 0, 0.4), 0.2, 0.2, 0.8), 1e-15);
    EXPECT_NEAR(distance(Cylinder{0.4, 0.25}), distance_from_cylinder(p + Point(0, 0, 0.25), 0.4, 0.5, 0), 1e-15);
    EXPECT_NEAR(distance(Ring{0.5, 0.15}), distance_from_torus(p, 0.5, 0.15), 1e-15);
  }
}

/// The normal is the gradient of the distance, wherever that has one.
TEST(Solids, NormalsLeadToTheSurface) {
  RandomPoints points;
  for (const Shape& shape : all_shapes()) {
    const Solid solid{shape, {rotation_matrix({0.3, -1, 0.5}), {0.1, 0.2, -0.1}}};
    for (int n = 0; n < 500; ++n) {
      const Point p = points.next(0.8);
      const SignedDistance gap = signed_distance(solid, p);
      EXPECT_NEAR(gap.normal.norm(), 1, 1e-12);
      const Point on_surface = p - gap.distance * gap.normal;
      EXPECT_NEAR(signed_distance(solid, on_surface).distance, 0, 1e-12) << shape.index();
    }
  }
}

// A point outside the box is at least as far from the shape, and points of the surface reach every side of the box.
TEST(Solids, FillTheBoxesRoundThem) {
  RandomPoints points;
  for (const Shape& shape : all_shapes()) {
    const Eigen::AlignedBox3d box = box_round(shape);
    Eigen::AlignedBox3d found;
    for (int n = 0; n < 2000; ++n) {
      const Point p = points.next(0.8);
      const SignedDistance gap = signed_distance(Solid{shape, {}}, p);
      EXPECT_LE(box.exteriorDistance(p), std::max(gap.distance, 0.0) + 1e-12) << shape.index();
      found.extend(p - gap.distance * gap.normal);
    }
    EXPECT_NEAR(found.max().z(), box.max().z(), 0.02) << shape.index();
    if (!std::holds_alternative<HalfSpace>(shape)) {
      EXPECT_LT((found.sizes() - box.sizes()).norm(), 0.05) << shape.index();
    }
  }
}

TEST(Solids, MiddlesAndSurfacesHaveUnitNormals) {
  for (const Shape& shape : all_shapes()) {
    for (const Point& p : {Point(0, 0, 0), Point(0.5, 0, 0), Point(0, 0, 0.2), Point(0.5, 0.3, 0.2)}) {
      EXPECT_NEAR(signed_distance(Solid{shape, {}}, p).normal.norm(), 1, 1e-12) << shape.index();
    }
  }
}

TEST(Solids, APoseTurnsAndMovesThem) {
  const Pose pose{rotation_matrix({0, 0, std::acos(-1) / 2}), {1, 2, 3}};
  const Solid box{Box{{0.5, 0.3, 0.2}}, pose};
  EXPECT_NEAR(signed_distance(box, {1, 2.7, 3}).distance, 0.2, 1e-14) << "its long edge lies along y";
  EXPECT_NEAR((signed_distance(box, {1, 2.7, 3}).normal - Point::UnitY()).norm(), 0, 1e-14);
  EXPECT_NEAR((pose.to_own(pose.to_world({4, 5, 6})) - Point(4, 5, 6)).norm(), 0, 1e-14);
}

TEST(ClosedMeshes, SayWhatIsWrongWithThem) {
  const std::vector<Point> points{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const Triangles closed{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
  EXPECT_EQ(fault_of_closed_mesh(points, closed), "");
  EXPECT_EQ(fault_of_closed_mesh(points, {closed[0], closed[1], closed[2]}),
            "the side between points 0 and 2 has a face on one side alone");
  EXPECT_EQ(fault_of_closed_mesh(points, {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {0, 2, 3}}), "its normals point inward");
  EXPECT_EQ(fault_of_closed_mesh(points, {}), "it has no faces");
}

/// Subdivided finely, no point of a triangle is deeper than the deepest.
TEST(DeepestPoints, AreTheDeepest) {
  RandomPoints points;
  constexpr double tolerance = 1e-4;
  for (const Shape& shape : all_shapes()) {
    const Solid solid{shape, {rotation_matrix({0.3, -1, 0.5}), {0.1, 0.2, -0.1}}};
    for (int n = 0; n < 60; ++n) {
      const Point middle = points.next(0.8);
      const Corners corners{middle + points.next(0.2), middle + points.next(0.2), middle + points.next(0.2)};
      const auto found = deepest_point(solid, corners, 10, tolerance);
      ASSERT_TRUE(found);
      EXPECT_NEAR(found->weights.sum(), 1, 1e-12);
      EXPECT_GE(found->weights.minCoeff(), 0);
      constexpr int parts = 100;
      double least = 10;
      for (int i = 0; i <= parts; ++i) {
        for (int j = 0; j <= parts - i; ++j) {
          const Point p = (i * corners[0] + j * corners[1] + (parts - i - j) * corners[2]) / parts;
          least = std::min(least, signed_distance(solid, p).distance);
        }
      }
      EXPECT_LE(found->gap.distance, least + tolerance) << "shape " << shape.index() << " case " << n;
      EXPECT_FALSE(deepest_point(solid, corners, found->gap.distance - 0.01, tolerance)) << shape.index();
    }
  }
}

TEST(DeepestPoints, OfTrianglesWithoutAreaAreThoseOfLinesAndPoints) {
  for (const Shape& shape : all_shapes()) {
    const Solid solid{shape, {}};
    const Point point(0.1, 0.2, 0.7);
    const auto of_point = deepest_point(solid, {point, point, point}, 1, 1e-5);
    ASSERT_TRUE(of_point);
    EXPECT_EQ(of_point->gap.distance, signed_distance(solid, point).distance);
    const Point end(0.3, -0.6, -0.5);
    const auto of_line = deepest_point(solid, {point, (point + end) / 2, end}, 1, 1e-5);
    ASSERT_TRUE(of_line);
    double least = 1;
    for (int i = 0; i <= 1000; ++i) {
      least = std::min(least, signed_distance(solid, point + i / 1000.0 * (end - point)).distance);
    }
    EXPECT_NEAR(of_line->gap.distance, least, 2e-4) << shape.index();
  }
}

TEST(DeepestPoints, FindAnEdgeBetweenTheCorners) {
  // The edge of a box, from below, in the middle of a triangle above it.
  const Solid box{Box{{0.5, 0.5, 0.5}}, {rotation_matrix({0, std::acos(-1) / 4, 0}), {0, 0, -std::sqrt(0.5)}}};
  const auto found =
      deepest_point(box, {Point(-0.3, -0.2, 1e-3), Point(0.4, -0.2, 1e-3), Point(0, 0.4, -1e-3)}, 1, 1e-6);
  ASSERT_TRUE(found);
  EXPECT_LT(found->gap.distance, -0.9e-3 * std::sqrt(0.5));
}

}  // namespace
}  // namespace pellicle
