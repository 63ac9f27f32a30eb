#include "geometry/nearest_points.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace pellicle {
namespace {

using FourCorners = std::array<Eigen::Vector3d, 4>;

Eigen::Vector3d weighted(const NearestPoints& nearest, const FourCorners& corners) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t a = 0; a < 4; ++a) {
    sum += nearest.weights[a] * corners[a];
  }
  return sum;
}

/// Points, triangles and edges in a cube; of every other one a coordinate is rounded, so that many are degenerate.
FourCorners random_corners(std::mt19937& random, bool coarse) {
  std::uniform_real_distribution<double> place(-1, 1);
  FourCorners corners;
  for (Eigen::Vector3d& corner : corners) {
    corner = Eigen::Vector3d::NullaryExpr([&] { return coarse ? std::round(place(random)) : place(random); });
  }
  return corners;
}

TEST(NearestPoints, NoPointOfATriangleIsNearer) {
  std::mt19937 random(1);
  for (int n = 0; n < 2000; ++n) {
    const FourCorners corners = random_corners(random, n % 2 == 0);
    const NearestPoints nearest = nearest_of_point_and_triangle(corners);
    EXPECT_LT((weighted(nearest, corners) - nearest.apart).norm(), 1e-14);
    EXPECT_EQ(nearest.weights[0], 1);
    EXPECT_NEAR(nearest.weights[1] + nearest.weights[2] + nearest.weights[3], -1, 1e-15);
    constexpr int steps = 12;
    for (int i = 0; i <= steps; ++i) {
      for (int j = 0; i + j <= steps; ++j) {
        const double b = static_cast<double>(i) / steps;
        const double c = static_cast<double>(j) / steps;
        const Eigen::Vector3d other = corners[0] - (1 - b - c) * corners[1] - b * corners[2] - c * corners[3];
        ASSERT_LE(nearest.apart.norm(), other.norm() + 1e-14);
      }
    }
  }
}

TEST(NearestPoints, NoPointsOfTwoEdgesAreNearer) {
  std::mt19937 random(2);
  for (int n = 0; n < 2000; ++n) {
    const FourCorners corners = random_corners(random, n % 2 == 0);
    const NearestPoints nearest = nearest_of_edges(corners);
    EXPECT_LT((weighted(nearest, corners) - nearest.apart).norm(), 1e-14);
    EXPECT_NEAR(nearest.weights[0] + nearest.weights[1], 1, 1e-15);
    EXPECT_NEAR(nearest.weights[2] + nearest.weights[3], -1, 1e-15);
    constexpr int steps = 12;
    for (int i = 0; i <= steps; ++i) {
      for (int j = 0; j <= steps; ++j) {
        const double s = static_cast<double>(i) / steps;
        const double t = static_cast<double>(j) / steps;
        const Eigen::Vector3d other = (1 - s) * corners[0] + s * corners[1] - (1 - t) * corners[2] - t * corners[3];
        ASSERT_LE(nearest.apart.norm(), other.norm() + 1e-14);
      }
    }
  }
}

}  // namespace
}  // namespace pellicle
