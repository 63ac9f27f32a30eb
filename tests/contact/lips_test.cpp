#include "contact/lips.h"

#include <gtest/gtest.h>
#include <petscsys.h>

#include <array>

#include "geometry/triangle_intersection.h"
#include "surface/membrane.h"
#include "tests/support/by_id.h"

namespace pellicle {
namespace {

/// Whether two triangles cut through each other.
bool cross(const Triangle& one, const Triangle& other) {
  for (std::size_t k = 0; k < 3; ++k) {
    if (segment_cuts_triangle(one[k], one[(k + 1) % 3], other) ||
        segment_cuts_triangle(other[k], other[(k + 1) % 3], one)) {
      return true;
    }
  }
  return false;
}

// Two folded triangles of a balloon that bursts, whose common corner is split: each moved towards its own middle they
// would cut through each other.
TEST(Lips, OfFoldedTrianglesOpenWithoutCuttingThroughEachOther) {
  int rank = 0;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  const Eigen::Vector3d common(-0.08948, -0.06684, 0.06388);
  SurfaceMesh mesh;
  if (rank == 0) {
    mesh.points = {
        {-0.0946, -0.07179, 0.05833}, {-0.0886, -0.07322, 0.06267}, common, {-0.09294, -0.07265, 0.06514}, common,
        {-0.09348, -0.06989, 0.0583}};
    mesh.faces = {{0, 1, 2}, {3, 4, 5}};
  }
  const Membrane membrane = make_membrane(PETSC_COMM_WORLD, mesh, SheetOptions());
  Field position(membrane.particles, 3);
  position.values() = membrane.rest;
  constexpr double thickness = 1.2e-3;
  open_lips({&membrane, thickness, 1}, std::vector<bool>(membrane.triangles.size(), true), {{2, 2}, {2, 4}},
            std::vector<bool>(static_cast<std::size_t>(membrane.particles.local())), position);
  const Eigen::Matrix3Xd at = by_id(membrane, position);
  EXPECT_NEAR((at.col(2) - common).norm(), lip_share * thickness, 1e-12);
  EXPECT_GT((at.col(4) - at.col(2)).norm(), 0.5 * lip_share * thickness);
  const auto triangle = [&at](Eigen::Index a, Eigen::Index b, Eigen::Index c) {
    return Triangle{at.col(a), at.col(b), at.col(c)};
  };
  EXPECT_FALSE(cross(triangle(0, 1, 2), triangle(3, 4, 5)));
}

}  // namespace
}  // namespace pellicle
