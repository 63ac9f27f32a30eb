#include "geometry/key_points.h"

#include <gtest/gtest.h>

namespace pellicle {
namespace {

const std::vector<std::vector<double>> path{{1, 0, 0, 0}, {2, 4, 0, -2}, {4, 4, 8, -2}};

TEST(KeyPoints, PathIsLinearBetweenRowsAndAtRestOutside) {
  EXPECT_EQ(place_on_key_points(path, 0), Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(place_on_key_points(path, 1), Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(place_on_key_points(path, 1.25), Eigen::Vector3d(1, 0, -0.5));
  EXPECT_EQ(place_on_key_points(path, 2), Eigen::Vector3d(4, 0, -2));
  EXPECT_EQ(place_on_key_points(path, 3), Eigen::Vector3d(4, 4, -2));
  EXPECT_EQ(place_on_key_points(path, 9), Eigen::Vector3d(4, 8, -2));
}

TEST(KeyPoints, IntegralIsThatOfThePath) {
  EXPECT_EQ(integral_on_key_points(path, 0), Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(integral_on_key_points(path, 1.5), Eigen::Vector3d(0.5, 0, -0.25));
  EXPECT_EQ(integral_on_key_points(path, 3), Eigen::Vector3d(6, 2, -3));
  EXPECT_EQ(integral_on_key_points(path, 5), Eigen::Vector3d(14, 16, -7));
  EXPECT_EQ(integral_on_key_points({{2, 1, 2, 3}}, -2), Eigen::Vector3d(-2, -4, -6));
}

TEST(KeyPoints, ValueIsLinearBetweenRowsAndConstantOutside) {
  const std::vector<std::vector<double>> ramp{{1, 2}, {3, 6}};
  EXPECT_EQ(value_on_key_points(ramp, 0), 2);
  EXPECT_EQ(value_on_key_points(ramp, 1.5), 3);
  EXPECT_EQ(value_on_key_points(ramp, 3), 6);
  EXPECT_EQ(value_on_key_points(ramp, 4), 6);
  EXPECT_EQ(value_on_key_points({{0, 7}}, -1), 7);
  EXPECT_EQ(value_on_key_points({{0, 7}}, 1), 7);
}

TEST(KeyPoints, AMotionFollowsItsPathOrElseItsVelocity) {
  EXPECT_EQ(place_of_motion(path, {0, 0, 0}, 3), place_on_key_points(path, 3));
  EXPECT_EQ(place_of_motion({}, {1, -2, 4}, 0.5), Eigen::Vector3d(0.5, -1, 2));
}

TEST(KeyPoints, FaultsNameTheKeyPoint) {
  EXPECT_EQ(fault_of_key_points(path), "");
  EXPECT_EQ(fault_of_key_points({}), "");
  EXPECT_NE(fault_of_key_points({{0, 1, 2, 3}, {1, 2, 3}}).find("key point 2 has 3 numbers"), std::string::npos);
  EXPECT_NE(fault_of_key_points({{0, 1, 2, 3}}, {"time", "value"}).find("4 numbers, expected 2: time, value"),
            std::string::npos);
  EXPECT_NE(fault_of_key_points({{0, 1, 2, 3}, {0, 1, 2, 4}}).find("key point 2 is at"), std::string::npos);
}

}  // namespace
}  // namespace pellicle
