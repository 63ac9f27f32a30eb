#include "geometry/solid_distance.h"

#include <gtest/gtest.h>

#include <functional>

namespace pellicle {
namespace {

using Point = Eigen::Vector3d;

TEST(SolidDistance, HasTheRightValues) {
  EXPECT_DOUBLE_EQ(distance_from_sphere({0, 3, 4}, 2), 3);
  EXPECT_DOUBLE_EQ(distance_from_box({0, 0, 0.5}, {2, 2, 1}, 0), -0.5);
  EXPECT_DOUBLE_EQ(distance_from_box({5, 6, 0}, {2, 2, 1}, 0), 5);  // from an edge, 3 and 4 away
  EXPECT_DOUBLE_EQ(distance_from_box({5, 5, 0}, {2, 2, 1}, 0.5), std::sqrt(2.0) * 3.5 - 0.5);
  EXPECT_DOUBLE_EQ(distance_from_cylinder({0, 4, 2}, 1, 5, 0.25), 3);
  EXPECT_DOUBLE_EQ(distance_from_cylinder({0, 0.5, -2}, 1, 5, 0), 2);
  EXPECT_DOUBLE_EQ(distance_from_cylinder({4, 0, 9}, 1, 5, 0), 5);
  EXPECT_DOUBLE_EQ(distance_from_round_cone({3, 0, 1}, 1, 1, 4), 2);
  EXPECT_DOUBLE_EQ(distance_from_round_cone({0, 0, -3}, 2, 1, 4), 1);
  EXPECT_DOUBLE_EQ(distance_from_round_cone({0, 0, 7}, 2, 1, 4), 2);
  EXPECT_DOUBLE_EQ(distance_from_torus({0, -3, 0}, 2, 0.5), 0.5);
  EXPECT_DOUBLE_EQ(distance_from_torus({0, 0, 0}, 2, 0.5), 1.5);
  EXPECT_DOUBLE_EQ(distance_from_ellipsoid({0, 0, 0}, {3, 2, 1}), -1);
}

TEST(SolidDistance, OfAConeIsThatOfTheLineThatTouchesBothBalls) {
  // Radii 2 and 1 at distance 2: the line makes 30 degrees with the axis and touches at 60 degrees from it.
  const Point touching(2 * std::cos(M_PI / 6), 0, 2 * std::sin(M_PI / 6));
  const Point normal(std::cos(M_PI / 6), 0, std::sin(M_PI / 6));
  const Point along(-std::sin(M_PI / 6), 0, std::cos(M_PI / 6));
  EXPECT_NEAR(distance_from_round_cone(touching + 0.4 * along + 0.7 * normal, 2, 1, 2), 0.7, 1e-14);
}

/// Outside, a distance grows by as much as the point moves away; the ellipsoid's does on its surface.
TEST(SolidDistance, HasAGradientOfLength1) {
  const std::vector<std::function<double(const Point&)>> exact{
      [](const Point& p) { return distance_from_sphere(p, 0.6); },
      [](const Point& p) {
        return distance_from_box(p, {0.5, 0.4, 0.3}, 0.1);
      },
      [](const Point& p) { return distance_from_cylinder(p, 0.4, 0.5, 0.1); },
      [](const Point& p) { return distance_from_round_cone(p, 0.4, 0.2, 0.5); },
      [](const Point& p) { return distance_from_torus(p, 0.6, 0.2); }};
  const auto steepness = [](const std::function<double(const Point&)>& distance, const Point& at) {
    constexpr double step = 1e-6;
    Point gradient;
    for (int k = 0; k < 3; ++k) {
      gradient[k] = (distance(at + step * Point::Unit(k)) - distance(at - step * Point::Unit(k))) / (2 * step);
    }
    return gradient.norm();
  };
  for (const Point& at : {Point(0.9, 0.7, -0.8), Point(-0.2, 1.1, 0.3), Point(0.1, -0.2, 1.5)}) {
    for (std::size_t i = 0; i < exact.size(); ++i) {
      EXPECT_NEAR(steepness(exact[i], at), 1, 1e-8) << "solid " << i;
    }
    const Point half(0.9, 0.5, 0.3);
    const Point on_surface = at / at.cwiseQuotient(half).norm();
    const auto ellipsoid = [&half](const Point& p) { return distance_from_ellipsoid(p, half); };
    EXPECT_NEAR(ellipsoid(on_surface), 0, 1e-15);
    EXPECT_NEAR(steepness(ellipsoid, on_surface), 1, 1e-6);
  }
}

}  // namespace
}  // namespace pellicle
