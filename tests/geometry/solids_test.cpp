#include "geometry/solids.h"

#include <gtest/gtest.h>

#include <cmath>

namespace pellicle {
namespace {

TEST(Solids, distance_to_a_sphere_is_the_arm_less_the_radius) {
  const Sphere sphere{{1, 2, 3}, 0.5};
  const Eigen::Vector3d direction = Eigen::Vector3d(1, -2, 2) / 3;
  for (const double arm : {0.1, 0.5, 2.0}) {
    const SignedDistance gap = signed_distance(sphere, sphere.centre + arm * direction);
    EXPECT_NEAR(gap.distance, arm - 0.5, 1e-15);
    EXPECT_NEAR((gap.normal - direction).norm(), 0, 1e-14);
  }
}

TEST(Solids, centre_of_a_sphere_has_a_unit_normal) {
  const SignedDistance gap = signed_distance(Sphere{{1, 2, 3}, 0.5}, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(gap.distance, -0.5);
  EXPECT_EQ(gap.normal.norm(), 1);
}

TEST(Solids, distance_to_a_half_space_is_along_its_normal) {
  const Eigen::Vector3d normal = Eigen::Vector3d(0, 3, 4) / 5;
  const Solid half_space = HalfSpace{{1, 1, 1}, normal};
  const Eigen::Vector3d along(7, -4, 3);
  const SignedDistance gap = signed_distance(half_space, Eigen::Vector3d(1, 1, 1) + along - 0.25 * normal);
  EXPECT_NEAR(gap.distance, -0.25, 1e-14);
  EXPECT_EQ(gap.normal, normal);
}

TEST(Solids, moving_keeps_distances) {
  const Eigen::Vector3d shift(0.1, -0.2, 0.3);
  const Eigen::Vector3d point(0.4, 0.5, 0.6);
  for (const Solid& solid : {Solid(Sphere{{0, 0, 1}, 0.5}), Solid(HalfSpace{{0, 0, 1}, {0, 0.6, 0.8}})}) {
    EXPECT_NEAR(signed_distance(moved_by(shift, solid), point + shift).distance, signed_distance(solid, point).distance,
                1e-15);
  }
}

}  // namespace
}  // namespace pellicle
