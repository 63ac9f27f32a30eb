#include "geometry/rigid_motion.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

namespace pellicle {
namespace {

const double pi = std::acos(-1);

TEST(RigidMotions, TurnByKeyPointsOfTheRotationVector) {
  RigidMotion motion;
  motion.start.place = {1, 0, 0};
  motion.rotation = {{1, 0, 0, 0}, {2, 0, 0, 4 * pi}, {3, 0, 0, 4 * pi}};
  EXPECT_LT((motion.at(0.5).turn - Eigen::Matrix3d::Identity()).norm(), 1e-15);
  EXPECT_LT((motion.at(1.125).turn * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm(), 1e-14);
  EXPECT_LT((motion.at(2.5).turn - Eigen::Matrix3d::Identity()).norm(), 1e-14) << "twice round";
  EXPECT_EQ(motion.at(2.5).place, Eigen::Vector3d(1, 0, 0)) << "about its origin";
}

TEST(RigidMotions, GoOnAtConstantVelocities) {
  RigidMotion motion;
  motion.start = {rotation_matrix({pi / 2, 0, 0}), {1, 2, 3}};
  motion.velocity = {0, 0, 2};
  motion.angular_velocity = {0, 0, pi};
  const Pose pose = motion.at(0.5);
  EXPECT_LT((pose.place - Eigen::Vector3d(1, 2, 4)).norm(), 1e-15);
  // First about x, then about z: y goes to z and stays there.
  EXPECT_LT((pose.turn * Eigen::Vector3d::UnitY() - Eigen::Vector3d::UnitZ()).norm(), 1e-14);
  EXPECT_LT((pose.turn * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm(), 1e-14);
  motion.path = {{0, 5, 5, 5}, {1, 7, 5, 5}};
  motion.velocity.setZero();
  EXPECT_LT((motion.at(0.5).place - Eigen::Vector3d(6, 5, 5)).norm(), 1e-15) << "a path replaces place and velocity";
}

TEST(RigidMotions, SayWhatIsWrongWithThem) {
  RigidMotion motion;
  EXPECT_EQ(fault_of(motion), "");
  motion.rotation = {{0, 0, 0, 0}, {0, 1, 0, 0}};
  EXPECT_EQ(fault_of(motion).rfind(".rotation: key point 2 is at 0", 0), 0U);
  motion.rotation = {{0, 0, 0, 0}};
  motion.angular_velocity = {0, 0, 1};
  EXPECT_EQ(fault_of(motion), ": both rotation and angular_velocity given, expected one of them");
}

TEST(RigidMotions, RotationBetweenTurnsOneDirectionIntoTheOther) {
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  for (const Eigen::Vector3d& to : {Eigen::Vector3d(1, 2, -0.5), Eigen::Vector3d(0, 0, 3), Eigen::Vector3d(0, 0, -3),
                                    Eigen::Vector3d(1e-9, 0, -1), Eigen::Vector3d(1e-9, 0, 1)}) {
    const Eigen::Matrix3d turn = rotation_between(2 * z, to);
    EXPECT_LT((turn * z - to.normalized()).norm(), 1e-14) << to.transpose();
    EXPECT_LT((turn * turn.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-14);
    EXPECT_NEAR(turn.determinant(), 1, 1e-14);
    // The smallest one: what is across both stays.
    const Eigen::Vector3d across = z.cross(to);
    EXPECT_LE((turn * across - across).norm(), 1e-14 * across.norm());
  }
}

}  // namespace
}  // namespace pellicle
