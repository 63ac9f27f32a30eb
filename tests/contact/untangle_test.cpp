#include "contact/untangle.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "meshing/closed_shapes.h"
#include "meshing/overlaps.h"
#include "tests/support/grid_mesh.h"

namespace pellicle::untangle_test {
namespace {

/// Puts a mesh into a tangle. Centres come last: to be called for all meshes before `finish`.
void add(TangledMesh& tangle, const SurfaceMesh& mesh, const Eigen::Affine3d& motion) {
  const auto first = static_cast<int>(tangle.particles.size());
  for (const Eigen::Vector3d& point : mesh.points) {
    tangle.particles.push_back(motion * point);
    tangle.constrained.push_back(false);
  }
  for (const auto& face : mesh.faces) {
    if (face.size() == 4) {
      tangle.centres.push_back({first + face[0], first + face[1], first + face[2], first + face[3]});
    } else {
      tangle.triangles.push_back({first + face[0], first + face[1], first + face[2]});
    }
  }
}

void finish(TangledMesh& tangle) {
  auto centre = static_cast<int>(tangle.particles.size());
  for (const std::array<int, 4>& corners : tangle.centres) {
    for (std::size_t k = 0; k < 4; ++k) {
      tangle.triangles.push_back({corners[k], corners[(k + 1) % 4], centre});
    }
    ++centre;
  }
}

int crossings(const TangledMesh& tangle) { return count_self_intersections(tangle.points(), tangle.triangles).pairs; }

double farthest_move(const TangledMesh& before, const TangledMesh& after) {
  double farthest = 0;
  for (std::size_t i = 0; i < before.particles.size(); ++i) {
    farthest = std::max(farthest, (after.particles[i] - before.particles[i]).norm());
  }
  return farthest;
}

constexpr double edge = 0.1;

TEST(Untangle, ACornerThatPokesThroughASheetIsDrawnOut) {
  TangledMesh tangle;
  const Eigen::AngleAxisd turn(0.5, Eigen::Vector3d(1, 1, 0.2).normalized());
  add(tangle, grid_mesh(10, 10, edge), Eigen::Affine3d::Identity());
  add(tangle, grid_mesh(8, 8, edge), Eigen::Translation3d(0.33, 0.27, -0.04) * turn);
  finish(tangle);
  const TangledMesh before = tangle;
  ASSERT_GT(crossings(before), 0);
  EXPECT_EQ(untangle(tangle), 0);
  EXPECT_EQ(crossings(tangle), 0);
  EXPECT_LT(farthest_move(before, tangle), 3 * edge);
}

TEST(Untangle, BallsThatOverlapComeApart) {
  TangledMesh tangle;
  const SurfaceMesh ball = icosphere_mesh(3, 1);
  add(tangle, ball, Eigen::Affine3d::Identity());
  add(tangle, ball, Eigen::Affine3d(Eigen::Translation3d(1.8, 0.2, 0.1)));
  const TangledMesh before = tangle;
  ASSERT_GT(crossings(before), 0);
  EXPECT_EQ(untangle(tangle), 0);
  EXPECT_EQ(crossings(tangle), 0);
  EXPECT_LT(farthest_move(before, tangle), 0.2);
}

TEST(Untangle, WhatIsHeldStays) {
  TangledMesh tangle;
  add(tangle, grid_mesh(6, 6, edge), Eigen::Affine3d::Identity());
  tangle.constrained.assign(tangle.constrained.size(), true);
  const std::size_t constrained = tangle.constrained.size();
  add(tangle, grid_mesh(3, 3, edge),
      Eigen::Translation3d(0.13, 0.17, -0.03) * Eigen::AngleAxisd(0.5, Eigen::Vector3d(1, -1, 0).normalized()));
  finish(tangle);
  const TangledMesh before = tangle;
  ASSERT_GT(crossings(before), 0);
  EXPECT_EQ(untangle(tangle), 0);
  EXPECT_EQ(crossings(tangle), 0);
  for (std::size_t i = 0; i < constrained; ++i) {
    EXPECT_EQ(tangle.particles[i], before.particles[i]);
  }
}

/// A sheet, and a strip that lies straight through it.
TangledMesh pierced_sheet(bool is_strip_held, bool is_sheet_held) {
  TangledMesh tangle;
  add(tangle, grid_mesh(10, 10, edge), Eigen::Affine3d::Identity());
  const auto sheet = static_cast<std::ptrdiff_t>(tangle.particles.size());
  const Eigen::AngleAxisd upright(-M_PI / 2, Eigen::Vector3d::UnitY());
  add(tangle, grid_mesh(8, 2, edge), Eigen::Translation3d(0.53, 0.42, -0.37) * upright);
  std::fill(tangle.constrained.begin(), tangle.constrained.begin() + sheet, is_sheet_held);
  std::fill(tangle.constrained.begin() + sheet, tangle.constrained.end(), is_strip_held);
  finish(tangle);
  return tangle;
}

TEST(Untangle, AStripThatLiesStraightThroughASheetGoesBesideIt) {
  TangledMesh tangle = pierced_sheet(false, false);
  const TangledMesh before = tangle;
  ASSERT_GT(crossings(before), 0);
  EXPECT_EQ(untangle(tangle), 0);
  EXPECT_EQ(crossings(tangle), 0);
  const Eigen::Vector3d displacement = tangle.particles.back() - before.particles.back();
  EXPECT_LT(displacement.norm(), 0.5 + edge) << "out by its shorter side";
  for (std::size_t i = 0; i < tangle.particles.size(); ++i) {
    const bool is_of_strip = i >= 121;
    const Eigen::Vector3d moved = is_of_strip ? displacement : Eigen::Vector3d::Zero();
    EXPECT_LT((tangle.particles[i] - before.particles[i] - moved).norm(), 1e-12);
  }
}

TEST(Untangle, OfTwoPiecesTheOneThatIsNotHeldMoves) {
  TangledMesh tangle = pierced_sheet(true, false);
  const TangledMesh before = tangle;
  EXPECT_EQ(untangle(tangle), 0);
  EXPECT_EQ(crossings(tangle), 0);
  EXPECT_EQ(tangle.particles.back(), before.particles.back());
  TangledMesh pinned = pierced_sheet(true, true);
  EXPECT_GT(untangle(pinned), 0);
}

}  // namespace
}  // namespace pellicle::untangle_test
