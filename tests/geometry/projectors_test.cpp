#include "geometry/projectors.h"

#include <gtest/gtest.h>

namespace pellicle {
namespace {

TEST(Projectors, AreTheIdentityButWhereAVertexIsBound) {
  Projectors projectors(4);
  const Eigen::Matrix3d in_plane = Eigen::Vector3d(1, 0, 1).asDiagonal();
  projectors.bind(3, Eigen::Matrix3d::Zero());
  projectors.bind(1, in_plane);
  projectors.bind(0, Eigen::Matrix3d::Identity());
  EXPECT_EQ(projectors.bound(), (std::vector<int>{3, 1}));
  EXPECT_TRUE(projectors.is_free(0) && !projectors.is_free(1) && projectors.is_free(2) && !projectors.is_free(3));
  EXPECT_EQ(projectors[0], Eigen::Matrix3d::Identity());
  EXPECT_EQ(projectors[1], in_plane);
  EXPECT_EQ(projectors[3], Eigen::Matrix3d::Zero());
  Eigen::Matrix3Xd vectors = Eigen::Matrix3Xd::Ones(3, 3);  // of the first three alone
  projectors.apply(vectors);
  EXPECT_EQ(vectors.col(0), Eigen::Vector3d::Ones());
  EXPECT_EQ(vectors.col(1), Eigen::Vector3d(1, 0, 1));
}

TEST(Projectors, ForgetTheLastVerticesAndTakeOthersInTheirPlace) {
  Projectors projectors(2);
  projectors.bind(0, Eigen::Matrix3d::Zero());
  projectors.resize(4);
  EXPECT_TRUE(projectors.is_free(3));
  projectors.bind(3, Eigen::Matrix3d::Zero());
  projectors.resize(2);
  EXPECT_EQ(projectors.bound(), std::vector<int>{0});
  projectors.resize(4);
  EXPECT_TRUE(projectors.is_free(3));
  projectors.bind(2, Eigen::Vector3d(0, 0, 1).asDiagonal());
  EXPECT_EQ(projectors[2](2, 2), 1);
  EXPECT_EQ(projectors[0], Eigen::Matrix3d::Zero());
}

}  // namespace
}  // namespace pellicle
