#include "geometry/ear_clipping.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

namespace pellicle {
namespace {

using Polygon = std::vector<Eigen::Vector3d>;

double area_of(const Polygon& corners, const Eigen::Vector3d& normal, std::vector<int>& triangles_at) {
  triangles_at.assign(corners.size(), 0);
  double area = 0;
  for (const auto& [a, b, c] : cut_ears(corners)) {
    const double twice = (corners[b] - corners[a]).cross(corners[c] - corners[a]).dot(normal);
    EXPECT_GT(twice, 0);
    area += twice / 2;
    for (const std::size_t corner : {a, b, c}) {
      ++triangles_at[corner];
    }
  }
  return area;
}

TEST(CutEars, SplitsConvexBentAndTiltedPolygonsWithoutOverlap) {
  // r(phi) makes gears and circles; many corners, so that a quadratic way shows.
  const int count = 20000;
  for (const double teeth : {0.0, 0.3, 0.9}) {
    Polygon corners;
    double expected = 0;
    const Eigen::AngleAxisd tilt(0.7, Eigen::Vector3d(1, 2, 3).normalized());
    for (int k = 0; k < count; ++k) {
      const double phi = 2 * M_PI * k / count;
      const double r = 1 + teeth * std::cos(200 * phi) / 1.01;
      corners.emplace_back(tilt * Eigen::Vector3d(r * std::cos(phi), r * std::sin(phi), 0));
    }
    for (int k = 0; k < count; ++k) {
      expected += 0.5 * corners[k].cross(corners[(k + 1) % count]).dot(tilt * Eigen::Vector3d::UnitZ());
    }
    std::vector<int> triangles_at;
    EXPECT_EQ(cut_ears(corners).size(), corners.size() - 2);
    EXPECT_NEAR(area_of(corners, tilt * Eigen::Vector3d::UnitZ(), triangles_at), expected, 1e-10);
    EXPECT_LT(*std::max_element(triangles_at.begin(), triangles_at.end()), 500);  // no fan
  }
}

TEST(CutEars, AcceptsCornersOnStraightSides) {
  const Polygon corners{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {3, 1, 0}, {0, 1, 0}, {0, 0.5, 0}};
  std::vector<int> triangles_at;
  EXPECT_NEAR(area_of(corners, Eigen::Vector3d::UnitZ(), triangles_at), 3, 1e-15);
}

TEST(CutEars, RefusesWhatCrossesItselfOrHasNoArea) {
  EXPECT_TRUE(cut_ears(Polygon(5, Eigen::Vector3d::Zero())).empty());
  EXPECT_TRUE(cut_ears({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {1.5, 0, 0}}).empty());
  // A pentagram: its corners turn one way, twice round.
  Polygon star;
  for (const int corner : {0, 2, 4, 1, 3}) {
    star.emplace_back(std::cos(0.4 * M_PI * corner), std::sin(0.4 * M_PI * corner), 0);
  }
  EXPECT_TRUE(cut_ears(star).empty());
}

}  // namespace
}  // namespace pellicle
